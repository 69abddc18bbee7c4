#pragma once

// A table of directions on a lattice, for programs that interpolate in it at a glance (theory 23.2).

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

#include "btfield/btf_set.hpp"
#include "host/btf/direction_table.hpp"

namespace btfield::detail {

/// Directions up to `steepest` on `side` × `side` points of a square, which the concentric map lays onto the
/// disc of theta: rings of the square are those of theta.
struct DirectionSquare {
    int side = 1;  ///< odd: the middle is theta 0
    double steepest = 0.0;
    bool tangents = false;  ///< between two rings places go by tan theta, else by theta

    [[nodiscard]] int count() const { return side * side; }
    /// Of point (index % side, index / side).
    [[nodiscard]] BtfDirection at(int index) const;
    /// Column and row of a direction, from 0 to side − 1; steeper ones are at the edge.
    [[nodiscard]] std::array<double, 2> place(const BtfDirection& direction) const;
};

/// Places of lights go by the tangent: planes are nearly linear in it.
struct DirectionLattice {
    DirectionSquare views, lights;
    /// [view][light], means over l_z, of the first planes of the table.
    std::vector<PictureWeights> entries;
};

/// \param progress  with the share that is done
[[nodiscard]] DirectionLattice direction_lattice(const DirectionTable& table, int side, std::size_t planes,
                                                 const std::function<void(double)>& progress);

}  // namespace btfield::detail
