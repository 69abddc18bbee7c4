#pragma once

#include <array>
#include <span>
#include <string>

namespace btfield::detail {

/// Whether unit vectors to lights tell a normal: three or more, not in one plane, or nearly so.
[[nodiscard]] bool tell_normals(std::span<const std::array<double, 3>> directions);
/// \throws InputError when unit vectors to lights do not tell a normal: fewer than three, or all in one plane
void check_directions(std::span<const std::array<double, 3>> directions, const std::string& asked);

}  // namespace btfield::detail
