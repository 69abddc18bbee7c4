#pragma once

// What a TIFF says of its colours, and their conversion.

#include <string>

#include "host/pictures/colour_profile.hpp"
#include "host/pictures/oiio/tiff_file.hpp"

namespace btfield::detail {

inline constexpr std::uint32_t gdal_nodata_tag = 42113;

/// Profile, primaries and TransferFunction.
[[nodiscard]] ColourMeaning tiff_colour_meaning(TIFF* tiff, const TiffLayout& layout);

/// Colours of the samples that the photometric interpretation is about: they are all planes of the picture.
/// \throws InputError
void interpret_tiff(TIFF* tiff, TiffLayout& layout, const ReadOptions& options, Picture& picture,
                    const std::string& asked);

/// Whether three samples are colours beside others, as far as names of planes do not tell otherwise. Writers
/// call stacks of many bands RGB too: those are colours where the file describes them.
[[nodiscard]] bool tiff_has_colours(TIFF* tiff, const TiffLayout& layout, const std::string& description);

/// Whether samples that are no colours as a whole may still be light: whole numbers that are called grey or
/// RGB and have neither names nor a place on the earth.
[[nodiscard]] bool tiff_hides_meaning(TIFF* tiff, const TiffLayout& layout, const std::string& description);

}  // namespace btfield::detail
