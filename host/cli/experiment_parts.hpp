#pragma once

/// \file
/// Commands below `experiment`, and what they have in common.

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "host/cli/command.hpp"

namespace btfield::cli {

void add_experiment_run(CLI::App& parent, Action& action);
void add_experiment_merge(CLI::App& parent, Action& action);
void add_experiment_table(CLI::App& parent, Action& action);
void add_experiment_report(CLI::App& parent, Action& action);
void add_experiment_forget(CLI::App& parent, Action& action);

/// Parts of a list, "a,b".
[[nodiscard]] std::vector<std::string> parts_of(const std::string& text);

}  // namespace btfield::cli
