#include "host/compound/regional_covariance.hpp"

#include <algorithm>
#include <cstddef>

#include "host/base/stop.hpp"
#include "host/base/work_part.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// Deviations from the means of each pixel's region, [pixel][plane].
struct Deviations {
    std::vector<float> values;
    std::vector<double> means;   ///< [region][plane]
    std::vector<double> pixels;  ///< [region]

    Deviations(const Image& image, std::span<const std::uint8_t> labels, int regions) {
        const auto d = static_cast<size_t>(image.planes());
        means.assign(static_cast<size_t>(regions) * d, 0.0);
        pixels.assign(static_cast<size_t>(regions), 0.0);
        for (const std::uint8_t label : labels) pixels[label] += 1.0;
        values.resize(labels.size() * d);
        for (size_t p = 0; p < d; ++p) {
            const std::span<const float> plane = image.plane(static_cast<int>(p));
            for (size_t n = 0; n < plane.size(); ++n)
                means[labels[n] * d + p] += static_cast<double>(plane[n]);
            for (size_t k = 0; k < pixels.size(); ++k)
                if (pixels[k] > 0.0) means[k * d + p] /= pixels[k];
            for (size_t n = 0; n < plane.size(); ++n)
                values[n * d + p] = plane[n] - static_cast<float>(means[labels[n] * d + p]);
        }
    }
};

/// Sums at one lag, [region][i][j], and the pairs of each region.
struct LagSums {
    std::vector<double> sums, pairs;
};

LagSums sums_at(const Deviations& y, Size size, std::span<const std::uint8_t> labels, size_t d, Offset s) {
    const size_t regions = y.pixels.size(), width = static_cast<size_t>(size.width);
    LagSums result{std::vector<double>(regions * d * d, 0.0), std::vector<double>(regions, 0.0)};
    const auto wrapped = [](int i, int n) { return static_cast<size_t>(((i % n) + n) % n); };
    for (int r = 0; r < size.height; ++r) {
        if (r % 64 == 0) stop_if_asked();
        const size_t here = static_cast<size_t>(r) * width, there = wrapped(r + s.row, size.height) * width;
        for (int c = 0; c < size.width; ++c) {
            const size_t a = here + static_cast<size_t>(c), b = there + wrapped(c + s.column, size.width);
            const size_t k = labels[a];
            if (labels[b] != k) continue;
            result.pairs[k] += 1.0;
            double* sums = result.sums.data() + k * d * d;
            for (size_t i = 0; i < d; ++i)
                for (size_t j = 0; j < d; ++j)
                    sums[i * d + j] += static_cast<double>(y.values[a * d + i] * y.values[b * d + j]);
        }
    }
    return result;
}

}  // namespace

std::vector<LagCovariance> regional_covariances(const Image& image, std::span<const std::uint8_t> labels,
                                                int regions, Offset box, PairCount count) {
    const Deviations y(image, labels, regions);
    const auto d = static_cast<size_t>(image.planes());
    std::vector<Offset> lags;
    for (int row = 0; row <= box.row; ++row)
        for (int column = row == 0 ? 0 : -box.column; column <= box.column; ++column)
            lags.push_back({row, column});
    std::vector<LagSums> sums(lags.size());
    for_each_part(static_cast<int>(lags.size()), [&](int l) {
        sums[static_cast<size_t>(l)] = sums_at(y, image.size(), labels, d, lags[static_cast<size_t>(l)]);
    });
    std::vector<LagCovariance> result;
    for (size_t k = 0; k < static_cast<size_t>(regions); ++k) {
        LagCovariance& own = result.emplace_back(image.planes(), image.size(), box);
        for (size_t p = 0; p < d; ++p) own.mean()[p] = y.means[k * d + p];
        for (size_t l = 0; l < lags.size(); ++l) {
            const double pairs = count == PairCount::pairs ? sums[l].pairs[k] : y.pixels[k];
            for (size_t i = 0; i < d; ++i)
                for (size_t j = 0; j < d; ++j)
                    own.set(static_cast<int>(i), static_cast<int>(j), lags[l],
                            pairs > 0.0 ? sums[l].sums[(k * d + i) * d + j] / pairs : 0.0);
        }
    }
    return result;
}

}  // namespace btfield::detail
