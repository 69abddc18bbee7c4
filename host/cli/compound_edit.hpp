#pragma once

/// \file
/// `compound edit`.

#include "host/cli/command.hpp"

namespace btfield::cli {

void add_compound_edit(CLI::App& parent, Action& action);

}  // namespace btfield::cli
