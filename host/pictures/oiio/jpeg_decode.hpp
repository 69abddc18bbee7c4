#pragma once

/// \file
/// What stands in a JPEG around its pixels, and those of four inks, which OpenImageIO turns into RGB without
/// their profile.

#include <filesystem>
#include <string>

#include "btfield/image_io.hpp"

namespace btfield::detail {

struct JpegMarkers {
    std::string missing_end;  ///< where the file breaks off before its end mark; empty when it is complete
    std::string profile;      ///< ICC, put together from its pieces; empty: none or damaged
    std::string exif;         ///< from its byte order mark on; empty: none
    int components = 0;
    bool adobe = false;  ///< written by a program of Adobe: inks are stored the other way round
};

/// The decoder pads what is missing with grey; so the end is looked for here.
[[nodiscard]] JpegMarkers jpeg_markers(const std::filesystem::path& path);

/// Four planes of the crop, 1 being all ink.
/// \throws InputError as read_picture()
[[nodiscard]] Image decode_inks(const std::filesystem::path& path, const std::optional<Crop>& crop,
                                const JpegMarkers& markers, const std::string& asked);

/// Size of a JPEG of four inks, as it is stored.
[[nodiscard]] Size size_of_inks(const std::filesystem::path& path, const std::string& asked);

}  // namespace btfield::detail
