#pragma once

/// \file
/// A picture that becomes a model.

#include <filesystem>

#include "btfield/image_io.hpp"
#include "btfield/models.hpp"

namespace btfield::cli {

/// Of the picture as it was read.
[[nodiscard]] Provenance provenance_of(const std::filesystem::path& path, const Picture& picture);

}  // namespace btfield::cli
