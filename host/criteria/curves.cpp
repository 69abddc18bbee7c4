#include "btfield/curves.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <string>

#include "btfield/error.hpp"
#include "btfield/lag_covariance.hpp"
#include "host/analysis/picture_spectra.hpp"
#include "host/base/text.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

constexpr int bins = 64, rings_to_octave = 3, longest_lag = 64;

std::vector<Offset> curve_lags(int shortest) {
    std::vector<Offset> lags{{0, 0}};
    for (int h = 1, step = 1; h <= longest_lag && 2 * h < shortest; h += step) {
        lags.insert(lags.end(), {{0, h}, {h, 0}, {h, h}, {h, -h}});
        if (h >= 4 && (h & (h - 1)) == 0) step = h / 2;  // 1, 2, 3, 4, 6, 8, 12, 16, …
    }
    return lags;
}

/// Rings of frequencies from 1/√2 cycles a pixel down: ring k ends at 2^(−1/2 − k/3).
class Rings {
  public:
    explicit Rings(int longest_side)
        : sums_(static_cast<size_t>(std::ceil(rings_to_octave * std::log2(longest_side)) + 1)),
          counts_(sums_.size()) {}

    [[nodiscard]] static double centre(size_t ring) {
        return std::exp2(-0.5 - (static_cast<double>(ring) + 0.5) / rings_to_octave);
    }
    void add(const PictureSpectrum& spectrum, Size size) {
        for (int r = 0; r < size.height; ++r) {
            const double v = std::min(r, size.height - r) / static_cast<double>(size.height);
            for (int c = 0; c < size.width; ++c) {
                const double u = std::min(c, size.width - c) / static_cast<double>(size.width);
                const double frequency = std::hypot(u, v);
                if (!(frequency > 0.0)) continue;
                const double place = rings_to_octave * (-0.5 - std::log2(frequency));
                const auto ring =
                    std::min(sums_.size() - 1, static_cast<size_t>(std::max(0.0, std::floor(place))));
                sums_[ring] += std::norm(spectrum[static_cast<size_t>(r) * static_cast<size_t>(size.width) +
                                                  static_cast<size_t>(c)]);
                ++counts_[ring];
            }
        }
    }
    [[nodiscard]] size_t size() const { return sums_.size(); }
    [[nodiscard]] bool holds(size_t ring) const { return counts_[ring] > 0; }
    [[nodiscard]] double mean(size_t ring) const { return sums_[ring] / static_cast<double>(counts_[ring]); }

  private:
    std::vector<double> sums_;
    std::vector<size_t> counts_;
};

void set_histogram(StatisticCurves::Plane& plane, std::span<const float> a, std::span<const float> b) {
    const auto [low_a, high_a] = std::ranges::minmax(a);
    const auto [low_b, high_b] = std::ranges::minmax(b);
    const auto low = static_cast<double>(std::min(low_a, low_b));
    const auto high = static_cast<double>(std::max(high_a, high_b));
    for (int k = 0; k <= bins; ++k) plane.edges.push_back(low + (high - low) * k / bins);
    plane.histogram.assign(bins, {0.0, 0.0});
    const auto count = [&](std::span<const float> values, size_t which) {
        const double share = 1.0 / static_cast<double>(values.size());
        for (const float v : values) {
            const double place = high > low ? bins * (static_cast<double>(v) - low) / (high - low) : 0.0;
            plane.histogram[std::min<size_t>(bins - 1, static_cast<size_t>(place))][which] += share;
        }
    };
    count(a, 0);
    count(b, 1);
}

void check(const Image& a, const Image& b) {
    const std::string asked = "draw the statistics of two pictures";
    if (a.planes() < 1 || b.planes() < 1)
        throw InputError(asked, "one of them is empty", "give two pictures");
    if (a.planes() != b.planes())
        throw InputError(
            asked,
            "the first has " + counted(a.planes(), "plane") + ", the second " + std::to_string(b.planes()),
            "give pictures with the same number of planes");
    for (const Image* image : {&a, &b})
        if (!std::ranges::all_of(image->values(), [](float v) { return std::isfinite(v); }))
            throw InputError(asked, "a value is NaN or infinite", "repair the picture");
}

}  // namespace

StatisticCurves statistic_curves(const Image& a, const Image& b) {
    check(a, b);
    StatisticCurves curves;
    curves.lags = curve_lags(std::min({a.height(), a.width(), b.height(), b.width()}));
    const std::vector<double> of_a = covariances_at(a, curves.lags), of_b = covariances_at(b, curves.lags);
    const auto d = static_cast<size_t>(a.planes());
    for (size_t p = 0; p < d; ++p) {
        StatisticCurves::Plane& plane = curves.planes.emplace_back();
        const int index = static_cast<int>(p);
        const auto [low, high] = std::ranges::minmax(a.plane(index));
        const double variance = low < high ? of_a[p * d + p] : std::numeric_limits<double>::quiet_NaN();
        for (size_t s = 0; s < curves.lags.size(); ++s) {
            const size_t at = (s * d + p) * d + p;
            plane.covariance.push_back({of_a[at] / variance, of_b[at] / variance});
        }
        const int longest = std::max({a.height(), a.width(), b.height(), b.width()});
        Rings rings_a(longest), rings_b(longest);
        rings_a.add(spectrum_of(a, index), a.size());
        rings_b.add(spectrum_of(b, index), b.size());
        for (size_t ring = rings_a.size(); ring-- > 0;) {
            if (!rings_a.holds(ring) || !rings_b.holds(ring)) continue;
            if (p == 0) curves.frequencies.push_back(Rings::centre(ring));
            plane.spectrum.push_back({rings_a.mean(ring) / static_cast<double>(area(a.size())) / variance,
                                      rings_b.mean(ring) / static_cast<double>(area(b.size())) / variance});
        }
        set_histogram(plane, a.plane(index), b.plane(index));
    }
    return curves;
}

}  // namespace btfield
