#pragma once

// Proof that a Hermitian matrix polynomial is positive definite on the whole frequency torus (theory 10.5).

#include "host/spectrum/lane_matrix.hpp"

namespace btfield::detail {

struct PositiveDefiniteness {
    /// Proven for every ω. False: an indefinite point was found, or the proof needed more squares than
    /// allowed.
    bool proven = false;
    /// Smallest eigenvalue met, in the basis of the polynomial; the centres come close to the minimum where
    /// it is small.
    double min_eigenvalue = 0.0;
};

/// With M = L Lᴴ at the centre of a square of half-width h, ‖L⁻¹ M(ω) L⁻ᴴ − I‖ <= h (‖L⁻¹ ∂₁M L⁻ᴴ‖ + ‖L⁻¹ ∂₂M
/// L⁻ᴴ‖) + ½ h² ‖M⁻¹‖ Σ_s 2 ‖M_s‖ (|s1| + |s2|)²: squares where this is below 1 hold positive definite
/// matrices only; others are divided in four.
[[nodiscard]] PositiveDefiniteness positive_everywhere(const HermitianPolynomial& polynomial);

}  // namespace btfield::detail
