#pragma once

// Minimum error boundary cuts (theory 17.2; P1 2.1).

#include <cstdint>
#include <span>
#include <vector>

namespace btfield::detail {

/// Boundary between two pictures that overlap in a strip of `rows` × `columns` pixels: the first one's pixel
/// is taken left of column cut[row], the other's from there on.
struct BoundaryCut {
    std::vector<int> cut;   ///< 1 <= cut[row] < columns, at most 1 from one row to the next
    std::int64_t cost = 0;  ///< Σ_rows of the errors on both sides of the cut
};

/// The boundary of least cost, by dynamic programming; of equal ones, the one further left at the last row
/// where they part. Precondition: columns >= 2, rows >= 1.
/// \param errors [row][column]: what the pictures differ by at a pixel
/// \param closed whether the last row is the first one's neighbour, as on a torus
[[nodiscard]] BoundaryCut minimum_cut(std::span<const std::int64_t> errors, int rows, int columns,
                                      bool closed = false);

}  // namespace btfield::detail
