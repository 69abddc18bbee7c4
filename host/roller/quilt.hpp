#pragma once

#include <vector>

#include "btfield/roller.hpp"
#include "host/roller/block_search.hpp"

namespace btfield::detail {

inline constexpr int smallest_block = 8;
/// Side of patches that suits the sample (theory 17.4).
[[nodiscard]] int usual_block_of(const Features& features);

/// Where a patch was laid.
struct Placement {
    Position origin;  ///< its first pixel on the torus
    Position from;    ///< its first pixel in the sample
    Strips strips;    ///< in which others lay already
};

/// How a quilt was laid, in turns: patches of a turn do not touch each other.
struct QuiltPlan {
    Size size, patch;
    std::vector<std::vector<Placement>> turns;
};

/// A torus of patches, found and cut one after the other (theory 17.3).
/// \param block at least smallest_block and at most the sample's sides
/// \param overlap 2 to half of the block
/// \param options seed, tolerance and progress of which
/// \param plan    null, or gets how it was laid
[[nodiscard]] SourceMap make_quilt(const Features& features, BlockSearch& search, Size size, int block,
                                   int overlap, const RollerOptions& options, QuiltPlan* plan = nullptr);

/// The same patches cut anew where `scale` × `scale` pixels stand for each of the plan's.
/// \param features of a sample `scale` times as large as the one that the plan was made for, or larger
[[nodiscard]] SourceMap lay_finer(const Features& features, const QuiltPlan& plan, int scale);

}  // namespace btfield::detail
