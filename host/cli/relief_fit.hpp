#pragma once

#include <CLI/CLI.hpp>

#include "host/cli/command.hpp"

namespace btfield::cli {

/// `btfield relief fit`, below `relief`.
void add_relief_fit(CLI::App& parent, Action& action);

}  // namespace btfield::cli
