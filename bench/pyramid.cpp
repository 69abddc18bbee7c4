#include "btfield/pyramid.hpp"

#include <memory>

#include "bench/cases.hpp"
#include "bench/peers/pyramid.hpp"
#include "bench/report.hpp"

namespace btfield::bench {
namespace {

constexpr Size size{800, 800};
constexpr int levels = 4;

/// Reads the picture and writes every level, once each.
Work work(const Image& image) {
    const auto values = static_cast<double>(image.values().size());
    return {.items = values, .bytes = values * sizeof(float) * (1.0 + 4.0 / 3.0)};
}

void check_peer(const Image& image) {
    const auto here = decompose(device(), image, levels, 2);
    const auto there = peer::decompose(image, levels);
    // Rounding of five-tap sums of values up to 1, twice, over the levels.
    for (std::size_t k = 0; k < here.size(); ++k)
        for (std::size_t i = 0; i < here[k].values().size(); ++i)
            must_agree(here[k].values()[i], there[k].values()[i], 40 * 6e-8, "pyramid");
}

}  // namespace

void add_pyramid() {
    const std::string name = "pyramid decompose 800 rgb K=4";
    add(name, [] {
        const auto image = std::make_shared<Image>(picture(size));
        return std::pair(work(*image), std::function<void()>([image] {
                             benchmark::DoNotOptimize(decompose(device(), *image, levels, 2));
                         }));
    });
    add(name + peer_suffix, [] {
        const auto image = std::make_shared<Image>(picture(size));
        check_peer(*image);
        return std::pair(work(*image), std::function<void()>([image] {
                             benchmark::DoNotOptimize(peer::decompose(*image, levels));
                         }));
    });
}

}  // namespace btfield::bench
