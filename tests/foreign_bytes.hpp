#pragma once

// What other libraries write, as bytes.

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "btfield/image_io.hpp"

namespace btfield::test {

/// An ICC profile of these primaries, whose light is value ^ exponent; of grey without primaries.
std::string profile_bytes(const std::optional<Chromaticities>& primaries, double exponent);

/// The profile that Little CMS has for sRGB.
std::string srgb_profile_bytes();

/// A profile of four inks: without any, white; of one alone, 100 - 100 × ink is the L* of grey.
std::string ink_profile_bytes();

/// A JPEG of four inks, 8 x 8 pixels, each the same all over.
std::string ink_jpeg(const std::array<unsigned char, 4>& inks, bool adobe);

/// A JPEG with segments (their markers and contents) put behind its start mark.
std::string with_segments(const std::string& jpeg, const std::vector<std::pair<int, std::string>>& segments);

}  // namespace btfield::test
