#pragma once

/// \file
/// Options that mean nothing to the model or estimator that other options choose: whoever gives one expects
/// something of it.

#include <CLI/CLI.hpp>
#include <string>

#include "btfield/compound.hpp"
#include "btfield/fit.hpp"

namespace btfield::cli {

/// Refuses those of the command that say nothing about this random field. A fit that chooses the model, or
/// fits all, has a use for each.
/// \param chooser  the option that names the model: "--model", "--local"
/// \throws UsageError naming the option, why it means nothing, and what to do
void refuse_idle_options(const CLI::App& command, const FitOptions& fit, const std::string& chooser);

/// Of `compound fit`: the same of regional models, and of moving averages those of the other estimator; what
/// clusters would be found by where labels are given.
void refuse_idle_options(const CLI::App& command, const CompoundOptions& compound, bool labels);

}  // namespace btfield::cli
