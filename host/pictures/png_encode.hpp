#pragma once

// PNG pictures, written through libpng alone: textures need nothing of OpenImageIO.

#include <filesystem>
#include <string>

#include "btfield/image.hpp"
#include "host/pictures/picture_format.hpp"

namespace btfield::detail {

/// Writes one plane as grey or three as colours, 8 or 16 bits, clamped to [0, 1]. sRGB colours say so, linear
/// ones have gAMA 1, and other planes a description where readers would take them for what they are not.
/// \throws InputError when a PNG cannot have the size or the disk is full
void encode_png(const std::filesystem::path& path, const Image& image, const Storage& storage,
                const std::string& asked);

}  // namespace btfield::detail
