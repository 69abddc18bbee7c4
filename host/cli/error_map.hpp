#pragma once

/// \file
/// Pictures of local errors.

#include <filesystem>
#include <span>

#include "btfield/image.hpp"

namespace btfield::cli {

/// Throws what write_error_map would throw for this name, before any work is done.
void check_error_map(const std::filesystem::path& path);

/// EXR and TIFF: one plane of float32 values as they are. Other formats: false colours from black (0) through
/// purple and orange to pale yellow (the largest error); magenta where the error is negative, that is, not
/// there.
void write_error_map(const std::filesystem::path& path, Size size, std::span<const float> errors);

}  // namespace btfield::cli
