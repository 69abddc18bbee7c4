#pragma once

#include <cstddef>
#include <vector>

namespace btfield::detail {

/// Distinct pixels spread over a picture of so many, ascending: all where there are no more than `count`.
[[nodiscard]] std::vector<std::size_t> spread_pixels(std::size_t pixels, std::size_t count);

}  // namespace btfield::detail
