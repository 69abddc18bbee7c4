#pragma once

// Pieces of the least-squares fits that fit(), fit_car(), fit_sar(), fit_mmrf() and fit_pmrf() share
// (theory 5.5, 5.6).

#include <cstdint>
#include <string>
#include <vector>

#include "btfield/lag_covariance.hpp"
#include "btfield/models.hpp"
#include "host/base/eigen.hpp"

namespace btfield::detail {

/// mean_r e_r e_rᵀ of the prediction errors e = Y − Σ_s A_s Y(r ⊕ s) on the lattice of the statistic.
/// Precondition: the statistic's box holds the support's difference box.
[[nodiscard]] Eigen::MatrixXd residual_covariance(const LinearField& field, const LagCovariance& statistic);

/// What was asked, for messages.
[[nodiscard]] std::string describe(const Support& support, int planes);

/// \throws InputError when no least-squares fit can follow: no plane or offset, repeated offsets or the
///     centre, per-pair sets of another size, lags that the statistic lacks, a constant plane.
void check_request(const LagCovariance& statistic, const Support& support);

/// Solves xx · x = right for the rows and columns in `used`, scaled to a unit diagonal so that planes of
/// different units do not count as ill-conditioned.
/// \throws InputError when they are singular
[[nodiscard]] Eigen::MatrixXd solve_normal_equations(const Eigen::MatrixXd& xx, const Eigen::MatrixXd& right,
                                                     const std::vector<Eigen::Index>& used,
                                                     const std::string& asked);

/// Σ in the asked form, positive definite. Planes that repeat each other (a grey picture stored as RGB) leave
/// no error of their own: eigenvalues are raised to 10⁻⁸ of the largest one, 10⁻⁴ of its standard deviation,
/// which no 8-bit picture shows. Computed on errors scaled by the planes' deviations, so that units do not
/// matter.
[[nodiscard]] Eigen::MatrixXd admissible_noise(const Eigen::MatrixXd& noise, NoiseForm form,
                                               const Eigen::MatrixXd& yy);

/// Sets every member of the field; theta is Θᵀ, ηd × d: a_{s,i,j} at (s·d + j, i).
void fill(LinearField& field, const Support& support, const Eigen::MatrixXd& theta,
          const Eigen::MatrixXd& noise);

}  // namespace btfield::detail
