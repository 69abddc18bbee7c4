#include "host/base/half.hpp"

#include <bit>
#include <cmath>

namespace btfield::detail {

float float_of_half(std::uint16_t half) {
    const std::uint32_t sign = static_cast<std::uint32_t>(half & 0x8000U) << 16U;
    const std::uint32_t exponent = (half >> 10U) & 31U, fraction = half & 1023U;
    if (exponent == 0) {
        const float value = std::ldexp(static_cast<float>(fraction), -24);
        return sign != 0 ? -value : value;
    }
    const std::uint32_t wide = exponent == 31 ? 255U : exponent + 112U;
    return std::bit_cast<float>(sign | (wide << 23U) | (fraction << 13U));
}

std::uint16_t half_of_float(float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    const auto sign = static_cast<std::uint16_t>((bits >> 16U) & 0x8000U);
    const float size = std::abs(value);
    const auto with_sign = [sign](std::uint32_t half) { return static_cast<std::uint16_t>(sign | half); };
    if (std::isnan(value)) return with_sign(0x7e00U);
    if (size >= 65520.0F) return with_sign(0x7c00U);
    // Denormal halves are multiples of 2^-24; rounding may make the least normal one.
    if (size < 0x1p-14F) return with_sign(static_cast<std::uint32_t>(std::nearbyint(size * 0x1p24F)));
    const std::uint32_t magnitude = bits & 0x7fffffffU;
    const std::uint32_t rounded = magnitude + 0xfffU + ((magnitude >> 13U) & 1U);
    return with_sign((rounded >> 13U) - (112U << 10U));
}

}  // namespace btfield::detail
