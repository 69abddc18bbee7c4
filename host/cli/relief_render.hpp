#pragma once

#include <CLI/CLI.hpp>

#include "host/cli/command.hpp"

namespace btfield::cli {

/// `btfield relief render`, below `relief`.
void add_relief_render(CLI::App& parent, Action& action);

}  // namespace btfield::cli
