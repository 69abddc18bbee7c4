#pragma once

// Markov random fields frequency by frequency, as P4 2.6 and 2.7 write them, in float64.

#include <Eigen/Core>

#include "btfield/lag_covariance.hpp"
#include "btfield/models.hpp"

namespace btfield::reference {

/// Λ_t = I − Σ_s A_s e^{iω·s}
Eigen::MatrixXcd lambda(const LinearField& field, double row, double column);

/// S_t⁻¹: Σ⁻¹ Λ for the MMRF, Λ Σ^{−1/2} Λ⁻¹ Σ^{−1/2} Λ for the PMRF.
Eigen::MatrixXcd inverse_density(const MrfModel& model, double row, double column);

/// C(s) of the field: mean over a grid of side × side frequencies of conj(S_t) e^{iω·s}.
LagCovariance covariances(const MrfModel& model, int side, Offset box);

}  // namespace btfield::reference
