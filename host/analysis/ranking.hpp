#pragma once

// The order of a plane's values (theory 13.1).

#include <cstdint>
#include <span>
#include <vector>

namespace btfield::detail {

/// A pixel's value as a key whose unsigned order is the order of floats (−0 and +0 alike), and its place.
struct RankedPixel {
    std::uint32_t key = 0;
    std::uint32_t place = 0;
};

/// The key of a value and back; no NaN.
[[nodiscard]] std::uint32_t sort_key(float value);
[[nodiscard]] float sorted_value(std::uint32_t key);

/// Pixels by ascending value. Equal values come in pseudo-random order, the same each time: a function of the
/// values and `stream`; streams are unrelated. Takes time in proportion to the pixels.
/// \throws InputError when there are more than 2³² pixels
[[nodiscard]] std::vector<RankedPixel> ascending(std::span<const float> values, std::uint32_t stream);

}  // namespace btfield::detail
