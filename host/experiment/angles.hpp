#pragma once

/// \file
/// Directions of BTFs as people write them: degrees, phi within a turn.

#include <string>

#include "btfield/btf_set.hpp"

namespace btfield::detail {

[[nodiscard]] double in_degrees(double radians);
[[nodiscard]] double from_degrees(double degrees);

/// Phi in [0, 2π), and 0 where theta is 0.
[[nodiscard]] BtfDirection within_a_turn(BtfDirection direction);

/// "30,45": theta and phi to four decimals.
[[nodiscard]] std::string angles_text(const BtfDirection& direction);

}  // namespace btfield::detail
