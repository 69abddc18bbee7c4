#pragma once

/// \file
/// Pictures of local errors.

#include <filesystem>
#include <optional>
#include <span>

#include "btfield/image_io.hpp"

namespace btfield::cli {

/// Throws what write_error_map would throw for this name and type, before any work is done.
void check_error_map(const std::filesystem::path& path, std::optional<PixelType> type,
                     std::optional<Size> size = {});

/// EXR and TIFF: one plane of values as they are, float unless told half. Other formats: false colours from
/// black (0) through purple and orange to pale yellow (the largest error); magenta where the error is
/// negative, that is, not there; uint8 unless told.
void write_error_map(const std::filesystem::path& path, Size size, std::span<const float> errors,
                     std::optional<PixelType> type);

}  // namespace btfield::cli
