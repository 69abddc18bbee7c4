#pragma once

// What all kinds of models have to be checked for.

#include <string>
#include <vector>

#include "btfield/models.hpp"

namespace btfield::detail {

/// What is wrong with the colour spaces of a model's planes; empty: nothing.
[[nodiscard]] std::string defect_of(const std::vector<ColourSpace>& spaces, ColourSpace all, int planes);

/// What is wrong with a model's maps; empty: nothing. Their names become those of files in a folder: they
/// lead out of it nowhere, and differ.
/// \param planes  of the model
[[nodiscard]] std::string defect_of(const std::vector<MaterialMap>& maps, int planes);

}  // namespace btfield::detail
