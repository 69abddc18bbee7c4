#pragma once

// What lies between the nodes of a frequency grid: zeros of det Λ, and narrow peaks of the spectral density
// (theory 10.3, 10.4).

#include <complex>
#include <vector>

#include "host/base/eigen.hpp"
#include "host/spectrum/spectral_form.hpp"

namespace btfield::detail {

/// Λ at the nodes ω = 2π (m, n) / side of a square grid, m = 0 … side/2, n = 0 … side − 1, [m][n].
struct NodeValues {
    int side = 0;
    std::vector<double> inverse_norm;  ///< ‖Λ⁻¹‖_F
    std::vector<std::complex<double>> determinant;
};

struct TorusSearch {
    int zeros = 0;
    /// False when some square of the finest division could neither be excluded nor shown to hold a zero: Λ is
    /// then singular there to about six digits, or so close to singular over so wide a region that the search
    /// gave up.
    bool decided = true;
    /// What has to be added to the means over the nodes to make them integrals; without zeros only.
    Eigen::MatrixXd covariance;    ///< to mean S
    double log_determinant = 0.0;  ///< to mean ln |det Λ|
};

/// Searches the whole torus, half of it by symmetry.
///
/// The torus is divided into squares of half-width h around the nodes. With
///
///     κ = h (‖Λ⁻¹∂₁Λ‖ + ‖Λ⁻¹∂₂Λ‖) + ½ h² ‖Λ⁻¹‖ Σ_s ‖A_s‖ (|s1| + |s2|)²
///
/// at its centre c, ‖Λ⁻¹(c) Λ(ω) − I‖ <= κ throughout a square: it holds no zero when κ < 1, and its density
/// is that of its centre to a few percent when κ < 1/4. Squares that fail either test are divided in three by
/// three (so that no edge passes through the axes, where symmetry may put zeros) and tested again. When the
/// squares that may hold zeros become no more, arg det Λ is followed along their edges, in steps that the
/// same bound proves shorter than half a turn: the turns around a square are the zeros inside. Zeros of
/// opposite sign closer together than the squares of that division, at most π/(9 side), may be missed when
/// there are others; when none is found, the division goes on until every square is excluded or `decided` is
/// false. When det Λ is real (A_s = A_{−s}: symmetric coefficients; Markov models), zeros form curves: then
/// the count is that of the grid's squares in which det Λ changes sign.
/// \param form in a basis of planes in which coefficients are small: zeros do not depend on the basis
[[nodiscard]] TorusSearch search_torus(const SpectralForm& form, const NodeValues& nodes);

}  // namespace btfield::detail
