#pragma once

// What pixels are compared by when they are clustered (theory 18.1).

#include <cstddef>
#include <string>
#include <vector>

#include "btfield/control_field.hpp"
#include "btfield/image.hpp"

namespace btfield::detail {

/// [plane][pixel]
struct PixelPlanes {
    PixelPlanes() = default;
    PixelPlanes(int plane_count, std::size_t pixel_count)
        : planes(plane_count), pixels(pixel_count), values(static_cast<std::size_t>(planes) * pixels) {}
    [[nodiscard]] float* plane(int p) { return values.data() + static_cast<std::size_t>(p) * pixels; }
    [[nodiscard]] const float* plane(int p) const {
        return values.data() + static_cast<std::size_t>(p) * pixels;
    }
    int planes = 0;
    std::size_t pixels = 0;
    std::vector<float> values;
};

/// CIE L*a*b* for the white D65 of three planes: XYZ, linear light, or else taken as sRGB.
/// \param scale  of the values beforehand
[[nodiscard]] PixelPlanes lab_of(const Image& picture, float scale = 1.0F);

/// Gaussian of standard deviation 1 pixel; beyond the edges their pixels go on.
[[nodiscard]] PixelPlanes smoothed(const PixelPlanes& planes, Size size);

/// The space that `automatic` stands for.
/// \throws InputError when the space needs three planes and the picture has others
[[nodiscard]] ClusterSpace space_of(const Image& picture, ClusterSpace space, const std::string& asked);

/// The planes of a space other than `automatic`, not smoothed. None where all are constant.
[[nodiscard]] PixelPlanes cluster_features_of(const Image& picture, ClusterSpace space);

/// Number of different colours, counted up to `limit`.
[[nodiscard]] int distinct_colours(const Image& picture, int limit);

}  // namespace btfield::detail
