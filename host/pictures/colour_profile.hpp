#pragma once

/// \file
/// What a file says of its colours beside their numbers, turned into the library's own spaces: ICC profiles
/// through Little CMS, primaries and exponents by themselves.

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "btfield/image_io.hpp"
#include "host/pictures/colour.hpp"

namespace btfield::detail {

/// Of one, three or (CMYK) four planes; alpha is elsewhere.
struct ColourMeaning {
    std::string profile;                      ///< ICC; empty: none
    std::optional<Chromaticities> primaries;  ///< without a profile
    /// Linear light is value ^ exponent; nothing: by the sRGB curve (integers), or linear already (floats).
    std::optional<double> exponent;
    /// The curve of ITU-R BT.709 leads to linear light instead.
    bool rec709_curve = false;
    /// Light of stored values from 0 to 1, evenly spaced, of each plane, instead; empty: none.
    std::array<std::vector<double>, 3> curves;
    /// 16/255 is black and 235/255 white, of more bits accordingly.
    bool narrow_range = false;
    std::string said_by;  ///< "from what its gAMA says", for remarks
};

/// Makes the picture's planes what its space then says: sRGB of integers, linear of floats and of what is
/// said to be linear light; CMYK becomes three planes. Numbers stay, bit by bit, where the meaning is theirs
/// already. With keep_values they stay always, and are unspecified unless they have that meaning. What was
/// done is added to the remarks.
void apply_meaning(Picture& picture, const ColourMeaning& meaning, bool keep_values);

/// CMYK as RGB by (1 - C)(1 - K), which is what programs without a profile show.
void convert_cmyk(Picture& picture, bool keep_values);

}  // namespace btfield::detail
