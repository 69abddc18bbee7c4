#pragma once

// A frequency grid with its tables, in the density that a Hermitian polynomial's narrowest peak needs.

#include <cstddef>

#include "host/spectrum/half_grid.hpp"
#include "host/spectrum/lag_transform.hpp"
#include "host/spectrum/lane_matrix.hpp"

namespace btfield::detail {

inline constexpr int most_levels = 10;  ///< of a grid: details of 4^−10, 1e-6

/// A grid and what depends on it alone.
struct Lattice {
    GridDensity density;
    FrequencyGrid grid;
    Waves waves;
    LagTransform lags;   ///< up to the support's reach
    LagTransform twice;  ///< up to differences within it
    Lattice(const GridDensity& asked, Offset reach)
        : density(asked),
          grid(clustered_grid(asked)),
          waves(grid.column, reach.column),
          lags(grid, reach),
          twice(grid, {2 * reach.row, 2 * reach.column}) {}
    Lattice(const Lattice&) = delete;
    Lattice& operator=(const Lattice&) = delete;
    [[nodiscard]] int rows() const { return static_cast<int>(grid.row.size()); }
    [[nodiscard]] std::size_t columns() const { return grid.column.size(); }
};

/// 1/√(λ/c) of the peak of Q⁻¹ at ω = 0, along whose sharpest direction v vᵀ Q v = λ + c ω²: how far the
/// field is correlated along rows and columns, in pixels; 1 when it is less.
struct Reach {
    double row = 1.0, column = 1.0;
};
[[nodiscard]] Reach correlation_reach(const HermitianPolynomial& q);

/// The grid with the levels that resolve this peak.
[[nodiscard]] GridDensity resolving(const HermitianPolynomial& q, GridDensity density);

}  // namespace btfield::detail
