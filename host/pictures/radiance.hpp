#pragma once

/// \file
/// Radiance pictures. OpenImageIO 2.4 looks neither at their primaries, exposure and gamma nor at XYZE.

#include <filesystem>
#include <string>

#include "btfield/image_io.hpp"
#include "host/pictures/picture_format.hpp"

namespace btfield::detail {

/// RGBE and XYZE, old and new run lengths, any of the eight orientations. Values are divided by EXPOSURE and
/// COLORCORR; GAMMA is undone, and PRIMARIES are converted, unless values are kept. Leaves `file_bytes`
/// alone.
/// \throws InputError as read_picture()
[[nodiscard]] Picture read_radiance(const std::filesystem::path& path, const ReadOptions& options,
                                    std::uintmax_t file_bytes, const std::string& asked);

/// RGBE of three planes, run-length coded; values below 0 become 0. Says PRIMARIES where the storage has
/// them.
/// \throws InputError when the disk is full
void write_radiance(const std::filesystem::path& path, const Image& image, const Storage& storage,
                    const std::string& asked);

}  // namespace btfield::detail
