#pragma once

/// \file
/// Decoding through OpenImageIO and libtiff: TIFF, EXR, WebP and HEIF.

#include <filesystem>
#include <string>

#include "btfield/image_io.hpp"
#include "host/pictures/picture_format.hpp"

namespace btfield::detail {

/// Reads what is wanted of a file that is known to be of the format. Values are not looked at.
/// \param file_bytes  size of the file, against headers that claim more than it can hold
/// \throws InputError as read_picture()
[[nodiscard]] Picture decode_picture(const std::filesystem::path& path, PictureFormat format,
                                     const ReadOptions& options, std::uintmax_t file_bytes,
                                     const std::string& asked);

}  // namespace btfield::detail
