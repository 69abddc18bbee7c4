#pragma once

/// \file
/// Small pictures inside an HTML page.

#include <filesystem>
#include <optional>
#include <string>

#include "btfield/image_io.hpp"

namespace btfield::detail {

/// The upper left corner of a picture, pixel for pixel, as a data URI; empty when the picture cannot be read.
/// \param white value that is shown white
/// \param side pixels at most
[[nodiscard]] std::string thumbnail_uri(const std::filesystem::path& picture, const std::optional<Crop>& crop,
                                        double white, int side);

[[nodiscard]] std::string thumbnail_uri(const Image& image, double white, int side);

[[nodiscard]] std::string base64(std::string_view bytes);

}  // namespace btfield::detail
