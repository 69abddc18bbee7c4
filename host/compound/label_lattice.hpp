#pragma once

#include <cstdint>
#include <vector>

#include "btfield/control_field.hpp"

namespace btfield::detail {

/// Labels of the pixels that a pyramid level's pixels were reduced to: every `step`-th row and column.
[[nodiscard]] std::vector<std::uint8_t> coarse_labels(const ControlField& field, int step);

/// The field on another lattice: begun again where it ends, or cut off.
[[nodiscard]] ControlField on_lattice(const ControlField& field, Size lattice);

}  // namespace btfield::detail
