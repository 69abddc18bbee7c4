#pragma once

/// \file
/// Encoding through OpenImageIO: JPEG, TIFF and EXR.

#include <filesystem>
#include <string>

#include "btfield/image.hpp"
#include "host/pictures/picture_format.hpp"

namespace btfield::detail {

/// Writes all planes; integer types clamp to [0, 1], HDR clamps to [0, ∞). Values must be finite and fit the
/// type.
/// \throws InputError when the format cannot hold the size or the disk is full
void encode_picture(const std::filesystem::path& path, const Image& image, const Storage& storage,
                    const std::string& asked);

}  // namespace btfield::detail
