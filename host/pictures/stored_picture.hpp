#pragma once

// The way from a picture to a file's bytes, whatever the format.

#include <filesystem>
#include <string>

#include "btfield/image.hpp"
#include "host/pictures/picture_format.hpp"

namespace btfield::detail {

/// Writes all planes as they are into a file that exists. Values must be finite and fit the type.
/// \throws InputError when the format cannot hold the size or the disk is full
void store_picture(const std::filesystem::path& path, const Image& image, const Storage& storage,
                   const std::string& asked);

}  // namespace btfield::detail
