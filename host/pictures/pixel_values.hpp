#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace btfield::detail {

/// v in [0, 1] as an integer of the type's whole range, nearest; outside it is clamped.
template <class T>
T to_integer(float value) {
    constexpr auto top = static_cast<float>(std::numeric_limits<T>::max());
    return static_cast<T>(std::lrint(std::clamp(value, 0.0F, 1.0F) * top));
}

}  // namespace btfield::detail
