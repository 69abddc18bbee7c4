#include "host/btf/picture_features.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "host/base/wide.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

constexpr size_t chunk = 512;
constexpr float largest_chroma = 112.0F;
constexpr float bins = static_cast<float>(feature_bins);

bool is_colour(const Image& picture) {
    return picture.planes() == 3 && picture.space() != ColourSpace::unspecified;
}

/// The cube root that L*a*b* has, with its straight piece; to 2e-7. Halley's steps from the exponent's third:
/// the library's root takes longer than the picture takes to be read.
[[gnu::always_inline]] inline float lab_root(float t) {
    const float positive = t > 216.0F / 24389.0F ? t : 1.0F;
    const auto third =
        static_cast<std::int32_t>(static_cast<float>(std::bit_cast<std::int32_t>(positive)) * (1.0F / 3.0F));
    float y = std::bit_cast<float>(third + 709921077);
    for (int step = 0; step < 2; ++step) {
        const float cube = y * y * y;
        y *= (cube + 2.0F * positive) / (2.0F * cube + positive);
    }
    return t > 216.0F / 24389.0F ? y : (24389.0F / 27.0F * t + 16.0F) / 116.0F;
}

[[gnu::always_inline]] inline std::uint8_t bin_of(float share) {
    const float at = share * bins;
    return static_cast<std::uint8_t>(static_cast<std::int32_t>(at < 0.0F       ? 0.0F
                                                               : at > bins - 1 ? bins - 1
                                                                               : at));
}

/// \param matrix  from the picture's colours, white at 1 in each, to X / X_n, Y, Z / Z_n
BTFIELD_WIDE void colour_feature_bins(const float* __restrict r, const float* __restrict g,
                                      const float* __restrict b, const float* matrix, size_t count,
                                      std::uint8_t* __restrict lightness, std::uint8_t* __restrict first,
                                      std::uint8_t* __restrict second) {
    for (size_t i = 0; i < count; ++i) {
        const float x = lab_root(matrix[0] * r[i] + matrix[1] * g[i] + matrix[2] * b[i]);
        const float y = lab_root(matrix[3] * r[i] + matrix[4] * g[i] + matrix[5] * b[i]);
        const float z = lab_root(matrix[6] * r[i] + matrix[7] * g[i] + matrix[8] * b[i]);
        lightness[i] = bin_of((116.0F * y - 16.0F) * 0.01F);
        first[i] = bin_of(0.5F + 500.0F * (x - y) / (2.0F * largest_chroma));
        second[i] = bin_of(0.5F + 200.0F * (y - z) / (2.0F * largest_chroma));
    }
}

BTFIELD_WIDE void grey_feature_bins(const float* __restrict values, float scale, size_t count,
                                    std::uint8_t* __restrict lightness) {
    for (size_t i = 0; i < count; ++i)
        lightness[i] = bin_of((116.0F * lab_root(scale * values[i]) - 16.0F) * 0.01F);
}

/// Counts in four places, so that equal neighbours do not wait for each other.
class Histogram {
  public:
    void add(const std::uint8_t* at, size_t count) {
        for (size_t i = 0; i < count; ++i) ++counts_[i % 4][at[i]];
    }
    void accumulate(size_t all, std::span<float> to) const {
        std::uint64_t sum = 0;
        for (size_t bin = 0; bin < to.size(); ++bin) {
            for (const auto& part : counts_) sum += part[bin];
            to[bin] = static_cast<float>(static_cast<double>(sum) / static_cast<double>(all));
        }
    }

  private:
    std::array<std::array<std::uint32_t, feature_bins>, 4> counts_{};
};

std::array<float, 9> matrix_of(const Image& picture, double white) {
    std::array<double, 9> matrix{0.4124564, 0.3575761, 0.1804375, 0.2126729, 0.7151522,
                                 0.0721750, 0.0193339, 0.1191920, 0.9503041};
    if (picture.space() == ColourSpace::xyz) matrix = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    constexpr std::array<double, 3> d65{0.95047, 1.0, 1.08883};
    std::array<float, 9> result{};
    for (size_t i = 0; i < 9; ++i) result[i] = static_cast<float>(matrix[i] / d65[i / 3] / white);
    return result;
}

}  // namespace

PictureMoments moments_of(const Image& picture) {
    PictureMoments moments;
    for (int p = 0; p < picture.planes(); ++p) {
        const auto plane = picture.plane(p);
        const auto at = [&](size_t i) { return static_cast<double>(std::max(plane[i], 0.0F)); };
        // About the first value, so that flat pictures have deviation 0.
        const double about = at(0), count = static_cast<double>(plane.size());
        std::array<double, 4> sums{}, squares{};
        for (size_t i = 0; i < plane.size(); ++i) {
            const double value = at(i) - about;
            sums[i % 4] += value;
            squares[i % 4] += value * value;
        }
        const double mean = (sums[0] + sums[1] + sums[2] + sums[3]) / count;
        const double square = (squares[0] + squares[1] + squares[2] + squares[3]) / count;
        moments.mean.push_back(about + mean);
        moments.deviation.push_back(std::sqrt(std::max(square - mean * mean, 0.0)));
    }
    return moments;
}

int feature_count(const Image& picture) {
    return feature_bins * (is_colour(picture) ? 3 : picture.planes());
}

void put_features(const Image& picture, double white, std::span<float> features) {
    const size_t pixels = area(picture.size());
    std::array<std::array<std::uint8_t, chunk>, 3> at{};
    std::vector<Histogram> histograms(features.size() / feature_bins);
    const std::array<float, 9> matrix = matrix_of(picture, white);
    for (size_t first = 0; first < pixels; first += chunk) {
        const size_t count = std::min(chunk, pixels - first);
        if (is_colour(picture)) {
            colour_feature_bins(picture.plane(0).data() + first, picture.plane(1).data() + first,
                                picture.plane(2).data() + first, matrix.data(), count, at[0].data(),
                                at[1].data(), at[2].data());
            for (size_t h = 0; h < 3; ++h) histograms[h].add(at[h].data(), count);
            continue;
        }
        for (size_t h = 0; h < histograms.size(); ++h) {
            grey_feature_bins(picture.plane(static_cast<int>(h)).data() + first,
                              static_cast<float>(1.0 / white), count, at[0].data());
            histograms[h].add(at[0].data(), count);
        }
    }
    for (size_t h = 0; h < histograms.size(); ++h)
        histograms[h].accumulate(pixels, features.subspan(h * feature_bins, feature_bins));
}

}  // namespace btfield::detail
