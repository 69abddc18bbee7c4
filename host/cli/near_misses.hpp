#pragma once

/// \file
/// What to do about options that a command does not have.

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace btfield::cli {

/// The command below `parent` whose name is spelt nearly as this word is; empty: none.
[[nodiscard]] std::string near_command(const CLI::App& parent, const std::string& word);

/// Advice about the first of the unknown words that there is any about: what the command has in its place,
/// an option with nearly that name, or the commands that have it. Empty where nothing suggests itself.
[[nodiscard]] std::string near_miss(const CLI::App& command, const std::vector<std::string>& unknown);

}  // namespace btfield::cli
