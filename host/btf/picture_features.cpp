#include "host/btf/picture_features.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "host/base/wide.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// Pixels that are worked on together.
constexpr size_t chunk = 64;
/// Histograms of more pixels tell nothing new: of large pictures as many as these, spread out.
constexpr size_t sampled_pixels = 16384;
constexpr size_t lanes = 16;
constexpr float largest_chroma = 112.0F;
constexpr float bins = static_cast<float>(feature_bins);

bool is_colour(const Image& picture) {
    return picture.planes() == 3 && picture.space() != ColourSpace::unspecified;
}

/// The cube root that L*a*b* has, with its straight piece; to 2e-7. Halley's steps from the exponent's third:
/// the library's root takes longer than the picture takes to be read.
/// Both pieces are computed, and one counts: loops with branches are not compiled for vectors.
[[gnu::always_inline]] inline float lab_root(float t) {
    constexpr float kink = 216.0F / 24389.0F;
    const float positive = __builtin_fabsf(t) + 1e-9F;  // a comparison would be compiled as a branch
    const float straight = (24389.0F / 27.0F / 116.0F) * t + 16.0F / 116.0F;
    const float third = static_cast<float>(__builtin_bit_cast(std::int32_t, positive)) * (1.0F / 3.0F);
    float y = __builtin_bit_cast(float, static_cast<std::int32_t>(third) + 709921077);
    float cube = y * y * y;
    y *= (cube + 2.0F * positive) / (2.0F * cube + positive);
    cube = y * y * y;
    y *= (cube + 2.0F * positive) / (2.0F * cube + positive);
    const float above = t > kink ? 1.0F : 0.0F;
    return straight + above * (y - straight);
}

[[gnu::always_inline]] inline std::uint8_t bin_of(float share) {
    const auto at = static_cast<std::int32_t>(share * bins + bins);
    const std::int32_t low = at > feature_bins ? at - feature_bins : 0;
    return static_cast<std::uint8_t>(low < feature_bins ? low : feature_bins - 1);
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

/// Adds Σ (v − about) and Σ (v − about)² of each lane, negative values counting as 0.
BTFIELD_WIDE void add_moments(const float* __restrict values, float about, size_t count,
                              double* __restrict sums, double* __restrict squares) {
    for (size_t i = 0; i < count; i += lanes)
        for (size_t k = 0; k < lanes; ++k) {
            const float value = values[i + k], light = 0.5F * (value + __builtin_fabsf(value));
            const double difference = static_cast<double>(light) - static_cast<double>(about);
            sums[k] += difference;
            squares[k] += difference * difference;
        }
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
        // About the first value, so that flat pictures have deviation 0.
        const float about = std::max(plane.front(), 0.0F);
        std::array<double, lanes> sums{}, squares{};
        const size_t whole = plane.size() / lanes * lanes;
        add_moments(plane.data(), about, whole, sums.data(), squares.data());
        for (size_t i = whole; i < plane.size(); ++i) {
            const double difference =
                static_cast<double>(std::max(plane[i], 0.0F)) - static_cast<double>(about);
            sums[i - whole] += difference;
            squares[i - whole] += difference * difference;
        }
        const auto count = static_cast<double>(plane.size());
        const double mean = std::accumulate(sums.begin(), sums.end(), 0.0) / count;
        const double square = std::accumulate(squares.begin(), squares.end(), 0.0) / count;
        moments.mean.push_back(static_cast<double>(about) + mean);
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
    // One chunk of several, at places that meet no pattern of the picture's.
    const size_t chunks = (pixels + chunk - 1) / chunk, step = std::max<size_t>(pixels / sampled_pixels, 1);
    size_t counted = 0;
    for (size_t group = 0; group * step < chunks; ++group) {
        const double share = 0.6180339887 * static_cast<double>(group);
        const auto within = static_cast<size_t>((share - std::floor(share)) * static_cast<double>(step));
        const size_t first = std::min(group * step + within, chunks - 1) * chunk;
        const size_t count = std::min(chunk, pixels - first);
        counted += count;
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
        histograms[h].accumulate(counted, features.subspan(h * feature_bins, feature_bins));
}

}  // namespace btfield::detail
