#pragma once

// Tensor grids of frequencies for integrals over the torus, denser where spectra of long-range fields peak.

#include <vector>

namespace btfield::detail {

/// Nodes ω = (row[m], column[n]); Σ_mn row_weight[m] column_weight[n] f(ω_mn) is the mean of f over the
/// torus, for f with f(−ω) = conj f(ω) and the real part taken: rows cover 0 <= ω1 <= π, columns all of [−π,
/// π].
struct FrequencyGrid {
    std::vector<double> row, row_weight;        ///< weight 2 where the mirrored row is left out
    std::vector<double> column, column_weight;  ///< both signs
};

/// Nodes per axis: `uniform` equally spaced ones, and `per_level` more for each factor of 4 by which the
/// smallest detail around ω = 0 is narrower than 1.
struct GridDensity {
    int uniform = 64;
    int per_level = 16;
    int row_levels = 0, column_levels = 0;
    friend bool operator==(const GridDensity&, const GridDensity&) = default;
};

/// Trapezoidal rule in t, t(ω) = Σ_k w_k 2 atan(4^k tan(ω/2)): t is analytic and maps the circle onto itself,
/// so sums over analytic periodic functions converge geometrically; its derivative, the density of nodes,
/// follows 1/|ω| down to ω = 4^−levels. Without levels it is the uniform grid. Precondition: even numbers of
/// nodes.
[[nodiscard]] FrequencyGrid clustered_grid(const GridDensity& density);

}  // namespace btfield::detail
