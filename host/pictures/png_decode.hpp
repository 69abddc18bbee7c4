#pragma once

/// \file
/// PNG through libpng: OpenImageIO would have libpng print what it thinks of a damaged file.

#include <filesystem>
#include <string>

#include "btfield/image_io.hpp"

namespace btfield::detail {

/// Grey and colours of any depth, palettes as colours, alpha set aside; colour chunks and the orientation of
/// EXIF or XMP are applied.
/// \throws InputError as read_picture()
[[nodiscard]] Picture decode_png(const std::filesystem::path& path, const ReadOptions& options,
                                 const std::string& asked);

}  // namespace btfield::detail
