#pragma once

/// \file
/// A configuration that comes without a file.

#include <filesystem>
#include <string>

#include "btfield/experiment.hpp"

namespace btfield::detail {

/// As read_experiment.
/// \param asked first part of the messages
[[nodiscard]] ExperimentConfig experiment_from_text(const std::string& text,
                                                    const std::filesystem::path& folder,
                                                    const std::string& asked);

}  // namespace btfield::detail
