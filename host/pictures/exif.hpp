#pragma once

/// \file
/// The few things of EXIF that decide how a picture looks.

#include <string_view>

namespace btfield::detail {

struct Exif {
    int orientation = 1;           ///< 1 to 8, as Orientation has it
    bool has_orientation = false;  ///< it says so itself
    bool from_xmp = false;         ///< XMP says so, and EXIF nothing
    bool adobe_rgb = false;  ///< the interoperability index of cameras that store Adobe RGB (1998): "R03"
};

/// \param block from its byte order mark on; what is damaged is passed over
[[nodiscard]] Exif read_exif(std::string_view block);

/// Before the XMP packet in the application segments of JPEG, and in PNG its keyword.
inline constexpr std::string_view jpeg_xmp_mark{"http://ns.adobe.com/xap/1.0/\0", 29};
inline constexpr std::string_view png_xmp_mark{"XML:com.adobe.xmp\0", 18};

/// tiff:Orientation of an XMP packet, which counts where EXIF has none.
void take_xmp(Exif& exif, std::string_view packet);

inline constexpr const char* xmp_orientation_remark = "it is turned as its XMP says";

}  // namespace btfield::detail
