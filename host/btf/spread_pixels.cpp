#include "host/btf/spread_pixels.hpp"

#include <algorithm>
#include <numeric>

namespace btfield::detail {

std::vector<std::size_t> spread_pixels(std::size_t pixels, std::size_t count) {
    // Multiples of a step without a common divisor.
    auto step = static_cast<std::size_t>(0.6180339887 * static_cast<double>(pixels));
    while (std::gcd(std::max<std::size_t>(step, 1), pixels) != 1) ++step;
    std::vector<std::size_t> chosen(std::min(pixels, count));
    for (std::size_t i = 0, at = 0; i < chosen.size(); ++i, at = (at + step) % pixels) chosen[i] = at;
    std::ranges::sort(chosen);
    return chosen;
}

}  // namespace btfield::detail
