#pragma once

/// \file
/// Options of fit that name a value or leave it to be chosen.

#include <CLI/CLI.hpp>

#include "btfield/fit.hpp"

namespace btfield::cli {

/// --model, --order, --neighbourhood, --levels, --factor.
void add_selection(CLI::App& command, FitOptions& fit);

}  // namespace btfield::cli
