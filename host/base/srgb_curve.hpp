#pragma once

// The sRGB curve.

#include <cmath>

namespace btfield::detail {

/// IEC 61966-2-1, its straight piece continued below 0 and its curve above 1.
[[nodiscard]] inline double srgb_encoded(double linear) {
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}
/// Its inverse.
[[nodiscard]] inline double srgb_decoded(double encoded) {
    return encoded <= 12.92 * 0.0031308 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

}  // namespace btfield::detail
