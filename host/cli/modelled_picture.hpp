#pragma once

/// \file
/// A picture that becomes a model, and the name that the model gets.

#include <filesystem>

#include "btfield/image_io.hpp"
#include "btfield/models.hpp"

namespace btfield::cli {

/// Refuses names of pictures, and what cannot be written, before any work is done.
/// \throws InputError
void check_model_output(const std::filesystem::path& output);
/// And what would overwrite this picture.
/// \throws InputError
void check_model_output(const std::filesystem::path& output, const std::filesystem::path& picture);

/// Of the picture as it was read.
[[nodiscard]] Provenance provenance_of(const std::filesystem::path& path, const Picture& picture);

}  // namespace btfield::cli
