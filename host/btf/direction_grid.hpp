#pragma once

// Directions of pictures on the grids that sets are measured on.

#include <numbers>
#include <string>
#include <vector>

#include "btfield/btf_set.hpp"

namespace btfield::detail {

[[nodiscard]] constexpr double radians(double degrees) {
    return degrees * std::numbers::pi / 180.0;
}
[[nodiscard]] constexpr double degrees(double radians) {
    return radians * 180.0 / std::numbers::pi;
}

/// "theta 15, phi 60", in degrees.
[[nodiscard]] std::string text_of(const BtfDirection& direction);

/// Phi in [0, 2π), and 0 where theta is 0.
[[nodiscard]] BtfDirection normalised(BtfDirection direction);

/// Directions of one picture as its source has them.
struct MeasuredPair {
    BtfDirection view, light;
    std::string what;  ///< the picture, for messages
};

/// Sets views, lights, true_lights, present and remarks. Where views are of the 81 or 151 directions, lights
/// that are not there become the nearest that is, but keep their true direction.
/// \param pairs  one to a picture, which all differ
/// \return the picture of each [view][light]; −1 where it is missing
/// \throws InputError when two pictures have the same directions, or one is not above the surface
[[nodiscard]] std::vector<int> arrange(const std::vector<MeasuredPair>& pairs, const std::string& asked,
                                       BtfDescription& description);

/// Of a view or a light that something is to be shown under.
/// \param asked  what was asked for
/// \param what   "view", "light"
/// \throws InputError when it is lower than 89 degrees, or no direction
void check_shown(const BtfDirection& direction, const char* what, const std::string& asked);

}  // namespace btfield::detail
