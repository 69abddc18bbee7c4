#pragma once

/// \file
/// What the subcommands share with main: each registers its options and, once the whole line is understood,
/// its action.

#include <CLI/CLI.hpp>
#include <functional>
#include <stdexcept>

namespace btfield::cli {

/// Set by the subcommand that was called; main runs it.
using Action = std::function<void()>;

/// Wrong usage that shows only when options are seen together (exit code 2).
class UsageError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

void add_devices(CLI::App& app, Action& action);
void add_version(CLI::App& app, Action& action);
void add_fit(CLI::App& app, Action& action);
void add_info(CLI::App& app, Action& action);
void add_synth(CLI::App& app, Action& action);
void add_roll(CLI::App& app, Action& action);
void add_compound(CLI::App& app, Action& action);
void add_relief(CLI::App& app, Action& action);
void add_btf(CLI::App& app, Action& action);
void add_compare(CLI::App& app, Action& action);
void add_experiment(CLI::App& app, Action& action);
void add_kappa(CLI::App& app, Action& action);
void add_memd(CLI::App& app, Action& action);
/// Hidden: what packages and builds call, and what users try.
void add_completion(CLI::App& app, Action& action);
void add_manual(CLI::App& app, Action& action);
void add_help(CLI::App& app, Action& action);

}  // namespace btfield::cli
