#pragma once

/// \file
/// The few things of EXIF that decide how a picture looks.

#include <string_view>

namespace btfield::detail {

struct Exif {
    int orientation = 1;     ///< 1 to 8, as Orientation has it
    bool adobe_rgb = false;  ///< the interoperability index of cameras that store Adobe RGB (1998): "R03"
};

/// \param block from its byte order mark on; what is damaged is passed over
[[nodiscard]] Exif read_exif(std::string_view block);

}  // namespace btfield::detail
