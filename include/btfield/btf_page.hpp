#pragma once

/// \file
/// A page for browsers that shows a material under any view and light (theory 23.2).

#include <cstdint>
#include <functional>
#include <string>

#include "btfield/api.hpp"
#include "btfield/btf_model.hpp"

namespace btfield {

struct BtfPageOptions {
    std::string title = "Material";
    int planes = 0;  ///< the first so many of the model; 0: all
    /// Called in the caller's thread with the share of the work that is done; what it throws ends it.
    std::function<void(double share)> progress;
};

/// One HTML page with all that it needs in it: a program for WebGL 2, the grown tile (planes in 8 bits,
/// height in 16), the model's tables, and one of 121 × 121 directions. It shows what BtfRenderer does.
/// \param grown  of the model
/// \throws InputError when the model has neither one colour nor three, the surface is not the model's, or
///     fewer planes than 1 or more than the model's are asked for
[[nodiscard]] BTFIELD_API std::string btf_page(const BtfModel& model, const BtfSynthesiser& grown,
                                               const BtfPageOptions& options = {});

}  // namespace btfield
