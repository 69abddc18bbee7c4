#include "btfield/lag_covariance.hpp"

#include <cmath>
#include <memory>

#include "bench/cases.hpp"
#include "bench/peers/lag_covariance.hpp"
#include "bench/report.hpp"

namespace btfield::bench {
namespace {

constexpr Size size{800, 800};

Offset box() {
    return difference_box(neighbourhood(5, NeighbourhoodKind::causal));
}

/// A multiply-add per pixel, pair of planes and stored lag.
Work work(const Image& image) {
    const Offset b = box();
    const double lags = b.row * (2 * b.column + 1) + b.column + 1;
    return {.items = static_cast<double>(area(image.size())) * image.planes() * image.planes() * lags};
}

void check_peer(const Image& image) {
    const Offset b = box();
    const LagCovariance here = lag_covariance(image, b);
    const auto there = peer::lag_covariance(image, b);
    const int d = image.planes();
    for (int s1 = 0; s1 <= b.row; ++s1)
        for (int s2 = s1 == 0 ? 0 : -b.column; s2 <= b.column; ++s2)
            for (int i = 0; i < d; ++i)
                for (int j = 0; j < d; ++j) {
                    const auto at =
                        static_cast<std::size_t>(((s1 * (2 * b.column + 1) + s2 + b.column) * d + i) * d + j);
                    // Float64 sums in different orders.
                    const double scale = std::sqrt(here(i, i, {}) * here(j, j, {}));
                    must_agree(here(i, j, {s1, s2}), there[at], 1e-9 * scale, "lag covariance");
                }
}

}  // namespace

void add_lag_covariance() {
    const std::string name = "lag covariances 800 rgb order 5";
    add(name, [] {
        const auto image = std::make_shared<Image>(picture(size));
        return std::pair(work(*image), std::function<void()>([image] {
                             benchmark::DoNotOptimize(lag_covariance(*image, box()));
                         }));
    });
    add(name + peer_suffix, [] {
        const auto image = std::make_shared<Image>(picture(size));
        check_peer(*image);
        return std::pair(work(*image), std::function<void()>([image] {
                             benchmark::DoNotOptimize(peer::lag_covariance(*image, box()));
                         }));
    });
}

}  // namespace btfield::bench
