// BTFs: pictures of made sets, and of grown surfaces under a new view or a new light.
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "bench/cases.hpp"
#include "bench/report.hpp"
#include "btfield/btf_model.hpp"
#include "btfield/height.hpp"
#include "btfield/made_btf.hpp"

namespace btfield::bench {
namespace {

constexpr Size sample_size{64, 64}, grown_size{512, 512};
constexpr double degrees = std::numbers::pi / 180.0;

/// Hills 8 pixels high.
BtfMaterial hills() {
    const Image sample = picture({4 * sample_size.height, 4 * sample_size.width});
    BtfMaterial material;
    material.height = Image(sample_size, 1);
    material.albedo = Image(sample_size, 3, ColourSpace::linear);
    for (int r = 0; r < sample_size.height; ++r)
        for (int c = 0; c < sample_size.width; ++c) {
            double sum = 0.0;
            for (int i = -2; i <= 2; ++i)
                for (int k = -2; k <= 2; ++k)
                    sum += static_cast<double>(sample.at(1, (r + i + sample_size.height) % sample_size.height,
                                                         (c + k + sample_size.width) % sample_size.width));
            material.height.at(0, r, c) = static_cast<float>(sum / 25.0);
            for (int p = 0; p < 3; ++p) material.albedo.at(p, r, c) = 0.2F + 0.5F * sample.at(p, r, c);
        }
    const auto values = material.height.values();
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    const float scale = 8.0F / (*high - *low), lowest = *low;
    for (float& value : values) value = (value - lowest) * scale - 4.0F;
    material.normals = normals_of_slopes(slopes_of_height(material.height, SurfaceEdges::periodic));
    return material;
}

std::vector<BtfDirection> rings() {
    std::vector<BtfDirection> all{{}};
    for (const double theta : {25.0, 50.0, 75.0})
        for (int k = 0; k < 6; ++k) all.push_back({theta * degrees, 60.0 * k * degrees});
    return all;
}

BtfSet made() {
    MadeBtfOptions options;
    options.views = options.lights = rings();
    return make_btf(device(), hills(), options);
}

std::shared_ptr<const BtfSynthesiser> grown() {
    static const auto kept = [] {
        BtfFitOptions options;
        options.periodic = true;
        options.field.levels = 1;
        const BtfModel model = fit_btf(device(), made(), options).model;
        return std::make_shared<const BtfSynthesiser>(device(), model, grown_size, 1, true);
    }();
    return kept;
}

Work work() {
    const auto pixels = static_cast<double>(area(grown_size));
    return {.items = pixels, .bytes = (17.0 + 3.0) * pixels * sizeof(float)};
}

}  // namespace

void add_btf() {
    const auto views = std::make_shared<const std::vector<BtfDirection>>(rings());
    add("btf new view of 16 planes 512", [views] {
        const auto surface = grown();
        const auto next = std::make_shared<std::size_t>(0);
        return std::pair(work(), std::function<void()>([surface, views, next] {
                             const BtfDirection view = (*views)[++*next % views->size()];
                             benchmark::DoNotOptimize(surface->picture(view, {0.6, 1.0}));
                         }));
    });
    add("btf new light of 16 planes 512", [] {
        const auto surface = grown();
        const auto next = std::make_shared<double>(0.0);
        return std::pair(work(), std::function<void()>([surface, next] {
                             *next += 0.1;
                             benchmark::DoNotOptimize(surface->picture({60.0 * degrees, 0.3}, {0.7, *next}));
                         }));
    });
    add("btf made picture 512", [views] {
        MadeBtfOptions options;
        options.views = options.lights = *views;
        BtfMaterial large = hills();
        const auto spread = [](const Image& image) {
            Image result(grown_size, image.planes(), image.space());
            for (int p = 0; p < image.planes(); ++p)
                for (int r = 0; r < grown_size.height; ++r)
                    for (int c = 0; c < grown_size.width; ++c)
                        result.at(p, r, c) = image.at(p, r % image.height(), c % image.width());
            return result;
        };
        large.height = spread(large.height);
        large.albedo = spread(large.albedo);
        large.normals = spread(large.normals);
        const auto set = std::make_shared<const BtfSet>(make_btf(device(), large, options));
        const auto next = std::make_shared<int>(0);
        const auto pixels = static_cast<double>(area(grown_size));
        return std::pair(Work{.items = pixels, .bytes = 10.0 * pixels * sizeof(float)},
                         std::function<void()>([set, next] {
                             const int n = static_cast<int>(set->views().size());
                             *next = (*next + 1) % (n * n);
                             benchmark::DoNotOptimize(set->picture(*next / n, *next % n));
                         }));
    });
}

}  // namespace btfield::bench
