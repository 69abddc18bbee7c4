#pragma once

/// \file
/// What is asked of a synthesiser: whether it can be done, and how its levels are grown.

#include <cstddef>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/synthesis.hpp"
#include "host/synthesis/synthesis_layout.hpp"

namespace btfield::detail {

/// Of each level of the model.
[[nodiscard]] std::vector<LevelRoute> routes_of(const TextureModel& model, const SynthesisOptions& options);

/// All that check_synthesis() checks but whether recursions are stable.
void check_request(const TextureModel& model, Size size, const SynthesisOptions& options);

/// What `work` says about a level's recursion, with the level's number.
template <class Work>
void at_level(std::size_t level, Work work) {
    try {
        work();
    } catch (const InputError& error) {
        throw InputError(error.asked() + " at level " + std::to_string(level), error.found(), error.remedy());
    }
}

}  // namespace btfield::detail
