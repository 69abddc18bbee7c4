#pragma once

#include "btfield/lag_covariance.hpp"
#include "btfield/models.hpp"

namespace btfield::reference {

/// Covariances of a moving average on the infinite lattice: C(u) = Σ_s A_s Σ_e A_{s+u}ᵀ, by C_ij(u) =
/// E y_i(r) y_j(r + u).
LagCovariance moving_average_covariance(const LinearField& field, Size lattice, Offset box);

}  // namespace btfield::reference
