#pragma once

/// \file
/// PBM, PGM and PPM. OpenImageIO 2.4 writes them with 8 bits only and reads every second 16-bit value one too
/// low, so these simple formats are read and written here.

#include <filesystem>
#include <string>

#include "btfield/image_io.hpp"

namespace btfield::detail {

/// P1 to P6, any maximum up to 65535, one picture or, of raw ones, several in a row. Leaves `file_bytes`
/// alone.
/// \throws InputError as read_picture().
[[nodiscard]] Picture read_pnm(const std::filesystem::path& path, const ReadOptions& options,
                               const std::string& asked);

/// The value that read_pnm() reads as 1.
/// \throws InputError when the header is damaged.
[[nodiscard]] int pnm_maximum(const std::filesystem::path& path, const std::string& asked);

/// P5 for one plane, P6 for three, maximum 255 or 65535.
/// \throws InputError when the disk is full.
void write_pnm(const std::filesystem::path& path, const Image& image, PixelType type,
               const std::string& asked);

}  // namespace btfield::detail
