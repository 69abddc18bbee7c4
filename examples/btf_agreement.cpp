// How pictures of one view under two lights go together, measured and grown: btf_agreement SET MODEL…
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <functional>
#include <memory>
#include <variant>
#include <vector>

#include "btfield/btf_model.hpp"
#include "btfield/btf_set.hpp"
#include "btfield/btf_textures.hpp"
#include "btfield/error.hpp"

namespace {

using Pictures = std::function<btfield::Image(const btfield::BtfDirection&, const btfield::BtfDirection&)>;

/// Pictures of a model, of twice the set's size: the larger the piece, the less it is a matter of chance.
Pictures grown(btfield::Device& device, const char* path) {
    const auto model = btfield::read_any_btf(path);
    const auto grow = [&]<typename Synthesiser>(const auto& of,
                                                std::shared_ptr<const Synthesiser>) -> Pictures {
        const btfield::Size size{2 * of.size.height, 2 * of.size.width};
        const auto shown = std::make_shared<const Synthesiser>(device, of, size, /*seed=*/1, true);
        return [shown](const auto& view, const auto& light) { return shown->picture(view, light); };
    };
    if (const auto* joint = std::get_if<btfield::BtfModel>(&model))
        return grow(*joint, std::shared_ptr<const btfield::BtfSynthesiser>());
    return grow(std::get<btfield::BtfTextures>(model),
                std::shared_ptr<const btfield::BtfTextureSynthesiser>());
}

/// Of all pixels and colours, each about its colour's mean.
double correlation(const btfield::Image& a, const btfield::Image& b) {
    double product = 0.0, of_a = 0.0, of_b = 0.0;
    for (int p = 0; p < a.planes(); ++p) {
        const auto x = a.plane(p), y = b.plane(p);
        double mean_x = 0.0, mean_y = 0.0;
        for (std::size_t i = 0; i < x.size(); ++i) {
            mean_x += static_cast<double>(x[i]) / static_cast<double>(x.size());
            mean_y += static_cast<double>(y[i]) / static_cast<double>(x.size());
        }
        for (std::size_t i = 0; i < x.size(); ++i) {
            const double dx = static_cast<double>(x[i]) - mean_x, dy = static_cast<double>(y[i]) - mean_y;
            product += dx * dy;
            of_a += dx * dx;
            of_b += dy * dy;
        }
    }
    return product / std::sqrt(of_a * of_b);
}

}  // namespace

int main(int count, char** arguments) {
    if (count < 3) {
        std::fprintf(stderr, "usage: btf_agreement SET MODEL...\n");
        return 2;
    }
    try {
        const btfield::BtfSet set = btfield::BtfSet::open(arguments[1]);
        btfield::Device device;
        std::vector<Pictures> models;
        for (int i = 2; i < count; ++i) models.push_back(grown(device, arguments[i]));
        std::vector<double> errors(models.size()), largest(models.size());
        int pairs = 0;
        constexpr double degree = 57.29577951308232;
        for (const std::size_t v : {std::size_t{0}, set.views().size() / 2}) {
            // Four lights, from rather high to low ones, and all their pairs.
            for (std::size_t i = 1; i < 8; i += 2)
                for (std::size_t k = i + 2; k < 8; k += 2) {
                    const std::size_t a = i * set.lights().size() / 8, b = k * set.lights().size() / 8;
                    const auto view = set.views()[v], one = set.lights()[a], other = set.lights()[b];
                    const int at = static_cast<int>(v);
                    const double truth = correlation(set.picture(at, static_cast<int>(a)),
                                                     set.picture(at, static_cast<int>(b)));
                    std::printf("view %3.0f,%3.0f  lights %3.0f,%3.0f and %3.0f,%3.0f  measured %6.3f  grown",
                                view.theta * degree, view.phi * degree, one.theta * degree, one.phi * degree,
                                other.theta * degree, other.phi * degree, truth);
                    for (std::size_t m = 0; m < models.size(); ++m) {
                        const double found = correlation(models[m](view, one), models[m](view, other));
                        const double error = std::abs(found - truth);
                        errors[m] += error;
                        largest[m] = std::max(largest[m], error);
                        std::printf(" %6.3f", found);
                    }
                    std::printf("\n");
                    ++pairs;
                }
        }
        for (std::size_t m = 0; m < models.size(); ++m)
            std::printf("%s: off by %.3f on average, %.3f at most\n", arguments[m + 2], errors[m] / pairs,
                        largest[m]);
        return 0;
    } catch (const btfield::Error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
