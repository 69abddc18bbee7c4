#pragma once

/// \file
/// What the commands of relief have in common: files of heights and normals, and what stands beside them.

#include <filesystem>
#include <string>

#include "btfield/height.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {

/// Whether the name is that of a format that holds heights in pixels; else they are coded in 16 bits.
/// \throws UsageError when the format does neither
[[nodiscard]] bool holds_pixels(const std::string& option, const std::filesystem::path& file);

/// "height.json" of "height.png".
[[nodiscard]] std::filesystem::path side_file(const std::filesystem::path& file);

/// Highest less lowest value.
[[nodiscard]] double range_of(const Image& height);

/// Writes a height, in pixels or coded with this scale.
void write_height(const std::filesystem::path& file, const Image& height, double scale);

/// What a side file says of heights, coded with this scale, and of axes.
[[nodiscard]] Json conventions_json(const Image& height, double scale, SurfaceEdges edges);

/// A JSON object as a text file.
void write_side_file(const std::filesystem::path& file, const Json& object);

}  // namespace btfield::cli
