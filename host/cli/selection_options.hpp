#pragma once

/// \file
/// Options of fit that name a value or leave it to be chosen.

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "btfield/fit.hpp"

namespace btfield::cli {

/// What --model may name beside random fields.
struct OtherModels {
    std::string words;  ///< "compound|roll"
    std::function<bool(const std::string& word)> take;
};

/// --model, --order, --neighbourhood, --levels, --factor.
void add_selection(CLI::App& command, FitOptions& fit, const OtherModels& others = {});

}  // namespace btfield::cli
