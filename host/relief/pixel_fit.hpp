#pragma once

// Photometric stereo of pixels, on the device (theory 19.3).

#include <array>
#include <cstddef>
#include <functional>
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
    /// Of amb, whether lights that disagree lose their weight slowly.
    bool few_lights = false;
};

/// How a value of a stack is stored.
enum class StackForm {
    light,   ///< float, linear, below 0 where saturated, its size being the value
    floats,  ///< linear; below 0 is dark
    bytes,   ///< whole numbers, the largest being saturated
    shorts,
};
[[nodiscard]] constexpr std::size_t bytes_of(StackForm form) {
    return form == StackForm::bytes ? 1 : form == StackForm::shorts ? 2 : sizeof(float);
}

/// Rows of a lobe's fit that lie together: the middle one leads, the others begin where it ends.
inline constexpr std::size_t group_rows = 3;

/// Values of pixels under lights, wherever they come from.
struct PixelStack {
    StackForm form = StackForm::light;
    std::size_t pixels = 0;
    /// Columns, where pixels are those of whole rows from a group's first on; 0: they have nothing to do with
    /// each other.
    std::size_t width = 0;
    int planes = 0;
    /// [light][plane], what stored values are multiplied by; not used for StackForm::light.
    std::vector<float> gains;
    /// Light of each whole number before that; empty: itself.
    std::vector<float> table;
    /// Writes stored values of a light, each plane `pitch` bytes behind the one before. Called from several
    /// threads.
    std::function<void(int light, std::byte* to, std::size_t pitch)> copy;
};

/// Of each pixel: [b_x, b_y, b_z, ambient, strength of the lobe][pixel]; b = ρ n.
inline constexpr int fit_planes = 5;
struct PixelFits {
    std::vector<float> fits;
    std::vector<float> albedo;    ///< [plane][pixel]
    std::vector<float> residual;  ///< [pixel], Σ |I − model| / Σ I without what is saturated
    /// [dark, saturated][pixel], how many values of all planes are below 1/50 of the brightest, or saturated.
    std::vector<float> counts;
};

/// \param lights  unit vectors
[[nodiscard]] PixelFits fit_pixels(DeviceImpl& device, const PixelStack& stack,
                                   std::span<const LightDirection> lights, const PixelRule& rule);

/// \param stack  [light][plane][pixel] of StackForm::light
[[nodiscard]] PixelFits fit_pixels(DeviceImpl& device, std::span<const float> stack, std::size_t pixels,
                                   int planes, std::span<const LightDirection> lights, const PixelRule& rule);

/// Rows of the pseudo-inverse: b = Σ_k row_k I_k.
[[nodiscard]] std::vector<LightDirection> pseudo_inverse(std::span<const LightDirection> lights);

/// What the fit of a pixel says of a light.
[[nodiscard]] double modelled_value(const std::array<double, fit_planes>& fit, const LightDirection& light,
                                    double roughness);

}  // namespace btfield::detail
