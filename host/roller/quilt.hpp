#pragma once

#include "btfield/roller.hpp"
#include "host/roller/block_search.hpp"

namespace btfield::detail {

/// A torus of patches, found and cut one after the other (theory 17.3).
/// \param block at least 8 and at most the sample's sides
/// \param overlap 2 to half of the block
/// \param options seed, tolerance and progress of which
[[nodiscard]] SourceMap make_quilt(const Features& features, BlockSearch& search, Size size, int block,
                                   int overlap, const RollerOptions& options);

}  // namespace btfield::detail
