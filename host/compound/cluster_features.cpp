#include "host/compound/cluster_features.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/parallel.hpp"
#include "host/base/wide.hpp"
#include "host/compound/compound_names.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

constexpr size_t pixels_at_once = 8192;
constexpr int smoothing_radius = 4;
constexpr int rows_smoothed_at_once = 16;
/// Values of three planes that say nothing of themselves are a picture's up to here.
constexpr float range_slack = 0.05F;
/// What float32 can be multiplied with and stay finite.
constexpr double most_scale = 1e30;

float linear_of_srgb(float v) {
    return v <= 0.04045F ? v / 12.92F : std::pow((v + 0.055F) / 1.055F, 2.4F);
}

float lab_scale(float t) {
    return t > 216.0F / 24389.0F ? std::cbrt(t) : (24389.0F / 27.0F * t + 16.0F) / 116.0F;
}

/// \param rgb  linear light
std::array<float, 3> xyz_of(const std::array<float, 3>& rgb) {
    const auto [r, g, b] = rgb;
    return {0.4124564F * r + 0.3575761F * g + 0.1804375F * b,
            0.2126729F * r + 0.7151522F * g + 0.0721750F * b,
            0.0193339F * r + 0.1191920F * g + 0.9503041F * b};
}

/// \param xyz  1 for white of luminance 1
std::array<float, 3> lab_of_xyz(const std::array<float, 3>& xyz) {
    const float x = lab_scale(xyz[0] / 0.95047F), y = lab_scale(xyz[1]), z = lab_scale(xyz[2] / 1.08883F);
    return {116.0F * y - 16.0F, 500.0F * (x - y), 200.0F * (y - z)};
}

template <class Work>
void for_each_pixel_block(size_t pixels, const Work& work) {
    for_each_block(static_cast<int>((pixels + pixels_at_once - 1) / pixels_at_once), [&](int block) {
        const size_t first = static_cast<size_t>(block) * pixels_at_once;
        work(first, std::min(pixels, first + pixels_at_once));
    });
}

std::array<float, smoothing_radius + 1> smoothing_weights() {
    std::array<float, smoothing_radius + 1> weights{};
    double sum = 0.0;
    for (int t = -smoothing_radius; t <= smoothing_radius; ++t) sum += std::exp(-0.5 * t * t);
    for (int t = 0; t <= smoothing_radius; ++t)
        weights[static_cast<size_t>(t)] = static_cast<float>(std::exp(-0.5 * t * t) / sum);
    return weights;
}

/// out = weights[0] middle + Σ_t weights[t] (before[t] + after[t])
BTFIELD_WIDE void weighted_rows(const float* weights, const float* const* before, const float* const* after,
                                float* out, size_t count) {
    for (size_t i = 0; i < count; ++i) out[i] = weights[0] * before[0][i];
    for (int t = 1; t <= smoothing_radius; ++t) {
        const float weight = weights[t];
        const float* __restrict a = before[t];
        const float* __restrict b = after[t];
        for (size_t i = 0; i < count; ++i) out[i] += weight * (a[i] + b[i]);
    }
}

void smooth_row(const float* plane, Size size, int row, const float* weights, std::vector<float>& padded,
                float* out) {
    const auto width = static_cast<size_t>(size.width);
    constexpr auto radius = static_cast<size_t>(smoothing_radius);
    std::array<const float*, radius + 1> before{}, after{};
    for (int t = 0; t <= smoothing_radius; ++t) {
        before[static_cast<size_t>(t)] = plane + static_cast<size_t>(std::max(0, row - t)) * width;
        after[static_cast<size_t>(t)] =
            plane + static_cast<size_t>(std::min(size.height - 1, row + t)) * width;
    }
    padded.resize(width + 2 * radius);
    weighted_rows(weights, before.data(), after.data(), padded.data() + radius, width);
    std::fill_n(padded.begin(), radius, padded[radius]);
    std::fill_n(padded.end() - smoothing_radius, radius, padded[radius + width - 1]);
    for (size_t t = 0; t <= radius; ++t) {
        before[t] = padded.data() + radius - t;
        after[t] = padded.data() + radius + t;
    }
    weighted_rows(weights, before.data(), after.data(), out, width);
}

struct PlaneScale {
    double mean = 0.0, deviation = 0.0;  ///< the latter 0 exactly where all values are the same
};

PlaneScale scale_of(std::span<const float> plane) {
    const auto first = static_cast<double>(plane.front()), count = static_cast<double>(plane.size());
    double sum = 0.0, squares = 0.0;
    for (const float value : plane) {
        const double v = static_cast<double>(value) - first;
        sum += v;
        squares += v * v;
    }
    const double mean = sum / count;
    return {first + mean, std::sqrt(std::max(0.0, squares / count - mean * mean))};
}

PixelPlanes scaled_planes(const Image& picture) {
    std::vector<PlaneScale> scales(static_cast<size_t>(picture.planes()));
    for_each_block(picture.planes(),
                   [&](int p) { scales[static_cast<size_t>(p)] = scale_of(picture.plane(p)); });
    const auto varying = std::ranges::count_if(scales, [](const PlaneScale& s) { return s.deviation > 0.0; });
    PixelPlanes planes(static_cast<int>(varying), area(picture.size()));
    int used = 0;
    for (int p = 0; p < picture.planes(); ++p) {
        const auto [mean, deviation] = scales[static_cast<size_t>(p)];
        if (!(deviation > 0.0)) continue;
        std::ranges::transform(picture.plane(p), planes.plane(used++),
                               [mean = mean, deviation = deviation](float v) {
                                   return static_cast<float>((static_cast<double>(v) - mean) / deviation);
                               });
    }
    return planes;
}

/// Halved or doubled until squares of differences are no trouble: nothing else changes.
PixelPlanes bounded_planes(const Image& picture) {
    PixelPlanes planes(picture.planes(), area(picture.size()));
    float largest = 0.0F;
    for (const float v : picture.values()) largest = std::max(largest, std::abs(v));
    const int halvings = largest > 0.0F ? std::ilogb(largest) : 0;
    std::ranges::transform(picture.values(), planes.values.begin(),
                           [&](float v) { return std::ldexp(v, -halvings); });
    return planes;
}

/// Light has no white of its own: its mean is taken for mid-grey, so that no unit matters.
float light_scale(const Image& picture) {
    constexpr double mid_grey = 0.18;
    double sum = 0.0;
    for (const float v : picture.values()) sum += std::abs(static_cast<double>(v));
    const double scale = mid_grey * static_cast<double>(picture.values().size()) / sum;
    return std::isfinite(scale) && scale < most_scale ? static_cast<float>(scale) : 1.0F;
}

/// Encoded values are parts of white, unless they are so large, or all so small, that they cannot be: then
/// the largest is white.
float encoded_scale(const Image& picture) {
    constexpr float darkest = 1.0F / 64.0F, brightest = 2.0F;
    float largest = 0.0F;
    for (const float v : picture.values()) largest = std::max(largest, std::abs(v));
    const bool parts = largest >= darkest && largest <= brightest;
    return parts || !(largest > 0.0F) ? 1.0F : 1.0F / largest;
}

float white_scale(const Image& picture) {
    const bool light = picture.space() == ColourSpace::linear || picture.space() == ColourSpace::xyz;
    return light ? light_scale(picture) : encoded_scale(picture);
}

}  // namespace

PixelPlanes lab_of(const Image& picture, float scale) {
    PixelPlanes lab(3, area(picture.size()));
    const ColourSpace space = picture.space();
    const bool encoded = space == ColourSpace::srgb || space == ColourSpace::unspecified;
    for_each_pixel_block(lab.pixels, [&](size_t first, size_t end) {
        for (size_t i = first; i < end; ++i) {
            std::array colour{picture.plane(0)[i], picture.plane(1)[i], picture.plane(2)[i]};
            for (float& v : colour) v *= scale;
            if (encoded) std::ranges::transform(colour, colour.begin(), linear_of_srgb);
            colour = lab_of_xyz(space == ColourSpace::xyz ? colour : xyz_of(colour));
            for (int p = 0; p < 3; ++p) lab.plane(p)[i] = colour[static_cast<size_t>(p)];
        }
    });
    return lab;
}

PixelPlanes smoothed(const PixelPlanes& planes, Size size) {
    PixelPlanes result(planes.planes, planes.pixels);
    const auto weights = smoothing_weights();
    const int bands = (size.height + rows_smoothed_at_once - 1) / rows_smoothed_at_once;
    for_each_block(bands, [&](int band) {
        std::vector<float> padded;
        const int first = band * rows_smoothed_at_once;
        for (int p = 0; p < planes.planes; ++p)
            for (int row = first; row < std::min(size.height, first + rows_smoothed_at_once); ++row)
                smooth_row(planes.plane(p), size, row, weights.data(), padded,
                           result.plane(p) + static_cast<size_t>(row) * static_cast<size_t>(size.width));
    });
    return result;
}

ClusterSpace space_of(const Image& picture, ClusterSpace space, const std::string& asked) {
    const bool three = picture.planes() == 3;
    if (space == ClusterSpace::automatic) {
        const bool colour =
            picture.space() != ColourSpace::unspecified || std::ranges::all_of(picture.values(), [](float v) {
                return v >= -range_slack && v <= 1.0F + range_slack;
            });
        return three && colour ? ClusterSpace::lab : ClusterSpace::planes;
    }
    const std::string word(word_of(space));
    if (space != ClusterSpace::planes && !three)
        throw InputError(asked,
                         "it has " + std::to_string(picture.planes()) +
                             (picture.planes() == 1 ? " plane" : " planes") + ", and the cluster space '" +
                             word + "' is one of three",
                         "use the space 'planes'");
    return space;
}

PixelPlanes cluster_features_of(const Image& picture, ClusterSpace space) {
    if (space == ClusterSpace::lab) return lab_of(picture, white_scale(picture));
    if (space == ClusterSpace::planes) return scaled_planes(picture);
    return bounded_planes(picture);
}

int distinct_colours(const Image& picture, int limit) {
    std::vector<size_t> known;  // a pixel of each colour, the last found first
    const auto same = [&](size_t a, size_t b) {
        for (int p = 0; p < picture.planes(); ++p)
            if (picture.plane(p)[a] != picture.plane(p)[b]) return false;
        return true;
    };
    for (size_t i = 0; i < area(picture.size()) && static_cast<int>(known.size()) < limit; ++i) {
        const auto found = std::ranges::find_if(known, [&](size_t k) { return same(k, i); });
        if (found == known.end())
            known.insert(known.begin(), i);
        else
            std::rotate(known.begin(), found, found + 1);
    }
    return static_cast<int>(known.size());
}

}  // namespace btfield::detail
