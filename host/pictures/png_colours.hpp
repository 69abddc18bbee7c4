#pragma once

/// \file
/// What the chunks of a PNG say of its colours and how it is turned.

#include <cstddef>
#include <string>
#include <string_view>

#include "host/pictures/colour_profile.hpp"
#include "host/pictures/exif.hpp"

namespace btfield::detail {

struct PngChunks {
    /// Contents of gAMA, cHRM, iCCP, cICP and eXIf.
    std::string gamma, primaries, profile, code_points, exif;
    std::string xmp;             ///< content of the iTXt that holds it
    std::string description;     ///< the text of that name
    std::string damaged;         ///< names of chunks that are not as they must be, and are ignored
    std::size_t behind_end = 0;  ///< bytes behind IEND
    bool has_srgb = false;
    bool animated = false;  ///< acTL: only the first picture is read
};

/// Of primaries and transfer function by ITU-T H.273, one byte each; others may follow.
/// \param where    "cICP", for remarks
/// \throws InputError for transfer functions that are not supported: PQ and HLG
[[nodiscard]] ColourMeaning meaning_of_code_points(std::string_view codes, const std::string& where,
                                                   std::string& remark, const std::string& asked);

/// The packet of an iTXt; empty when it is damaged.
[[nodiscard]] std::string xmp_packet(std::string_view chunk);

/// cICP before iCCP, before sRGB, before gAMA and cHRM, as the specification has it. A gamma of 1/2.2 is
/// sRGB's.
/// \throws InputError as meaning_of_code_points()
[[nodiscard]] ColourMeaning meaning_of(const PngChunks& chunks, std::string& remark,
                                       const std::string& asked);

}  // namespace btfield::detail
