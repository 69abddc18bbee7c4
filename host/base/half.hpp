#pragma once

// Numbers of half precision, IEEE 754 binary16, by their bits.

#include <cstdint>

namespace btfield::detail {

[[nodiscard]] float float_of_half(std::uint16_t half);
/// To the nearest, ties to even; beyond 65504 infinite.
[[nodiscard]] std::uint16_t half_of_float(float value);

}  // namespace btfield::detail
