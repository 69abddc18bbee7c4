#pragma once

/// \file
/// A picture that becomes a model.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

#include "btfield/height.hpp"
#include "btfield/image_io.hpp"
#include "btfield/models.hpp"

namespace btfield::cli {

/// Of the picture as it was read.
[[nodiscard]] Provenance provenance_of(const std::filesystem::path& path, const Picture& picture);

/// --flatten of what flatten_light() takes.
void add_flattening(CLI::App& app, Flattening& flattening);

/// Takes uneven light out of a picture where that is asked for; where not, tells it where it stands out.
/// \param of  the picture's name, for messages
/// \return    what was done, for the model's reasons; empty: nothing
[[nodiscard]] std::string flatten_light(const std::string& of, Image& image, Flattening flattening);

}  // namespace btfield::cli
