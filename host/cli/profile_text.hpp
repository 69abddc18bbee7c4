#pragma once

#include <string>
#include <vector>

#include "btfield/ceilings.hpp"

namespace btfield::cli {

/// 12.3 GB/s of copies, 456 G operations/s, 7.8 µs a launch.
[[nodiscard]] std::string ceilings_text(const Ceilings& ceilings);

/// Kernels in the order given, a line each, with the part of the nearer ceiling that each reached; then the
/// ceilings.
[[nodiscard]] std::string profile_text(const std::vector<ProfileEntry>& profile, const Ceilings& ceilings);

}  // namespace btfield::cli
