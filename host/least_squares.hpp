#pragma once

// Pieces of the least-squares fits that fit() shares with fit_car() and fit_sar().

#include <Eigen/Core>

#include "btfield/lag_covariance.hpp"
#include "btfield/models.hpp"

namespace btfield {

/// mean_r e_r e_rᵀ of the prediction errors e = Y − Σ_s A_s Y(r ⊕ s) on the lattice of the statistic.
/// Precondition: the statistic's box holds the support's difference box.
[[nodiscard]] Eigen::MatrixXd residual_covariance(const LinearField& field, const LagCovariance& statistic);

/// C(0) as a matrix.
[[nodiscard]] Eigen::MatrixXd lag_zero(const LagCovariance& statistic);

}  // namespace btfield
