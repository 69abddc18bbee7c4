#pragma once

// Photometric stereo of pixels, on the device (theory 19.3).

#include <array>
#include <span>
#include <vector>

#include "btfield/relief.hpp"
#include "host/cl/device_impl.hpp"

namespace btfield::detail {

using LightDirection = std::array<double, 3>;

/// More would not fit into a work-item's memory.
inline constexpr int most_lights = 4096;

/// A rule and what it needs; never automatic.
struct PixelRule {
    LightRule rule = LightRule::ls;
    double low = 0.35, high = 0.85;  ///< of ranks
    double roughness = 0.5;          ///< of lobe
};

/// Of each pixel: [b_x, b_y, b_z, ambient, strength of the lobe][pixel]; b = ρ n.
inline constexpr int fit_planes = 5;
struct PixelFits {
    std::vector<float> fits;
    std::vector<float> albedo;    ///< [plane][pixel]
    std::vector<float> residual;  ///< [pixel], Σ |I − model| / Σ I without what is saturated
};

/// \param stack  [light][plane][pixel], linear; below 0 where saturated, its size being the value
/// \param lights  unit vectors
[[nodiscard]] PixelFits fit_pixels(DeviceImpl& device, std::span<const float> stack, std::size_t pixels,
                                   int planes, std::span<const LightDirection> lights, const PixelRule& rule);

/// Rows of the pseudo-inverse: b = Σ_k row_k I_k.
[[nodiscard]] std::vector<LightDirection> pseudo_inverse(std::span<const LightDirection> lights);

/// What the fit of a pixel says of a light.
[[nodiscard]] double modelled_value(const std::array<double, fit_planes>& fit, const LightDirection& light,
                                    double roughness);

}  // namespace btfield::detail
