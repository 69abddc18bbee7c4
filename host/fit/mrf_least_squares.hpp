#pragma once

// Least-squares estimates of the Markov random fields.

#include <cstdint>
#include <vector>

#include "btfield/lag_covariance.hpp"
#include "btfield/models.hpp"

namespace btfield::detail {

struct MrfLeastSquaresOptions {
    int iterations = 50;  ///< at most
    /// Two iterations agree when no entry of any P_s (below) moved by more than this part of the largest one.
    double tolerance = 1e-10;
};

struct MrfEstimate {
    MrfModel model;
    int iterations = 1;
    bool converged = true;  ///< the last two iterations agreed
};

/// Least-squares MMRF estimate from lag covariances alone (theory 8.3; P4 eq. 46, 47). One joint vector of
/// unknowns for all planes, because Σ⁻¹ A_{−s} = (Σ⁻¹ A_s)ᵀ ties the planes' equations to each other.
///
/// - NoiseForm::diagonal, P4's form: a_{−s,j,i} = (σ_j/σ_i) a_{s,i,j}; minimises mean_r Σ_i e_{r,i}² for the
///   ratios of the last iteration, ratios 1 at first; σ_i = mean_r e_{r,i}².
/// - NoiseForm::full: minimises mean_r e_rᵀ Σ⁻¹ e_r for the Σ of the last iteration, Σ = C(0) at first; Σ =
///   mean_r e_r e_rᵀ. Turning the planes by any regular matrix turns the model with them.
///
/// Either way, in the planes z = R⁻¹ Y with R Rᵀ = Σ the unknowns are P_s = R⁻¹ A_s R with P_{−s} = P_sᵀ, so
/// that an iteration is one symmetric least-squares problem in lag covariances. A field of this model makes
/// the errors uncorrelated with all neighbours: on its covariances the estimate is exact.
///
/// \param support s and −s both; per-pair sets, with (s, i, j) also (−s, j, i), for NoiseForm::diagonal only
/// \throws InputError as fit_sar(), and for supports or per-pair sets that are not symmetric, per-pair sets
///     with full noise, more unknowns than fit into memory
[[nodiscard]] MrfEstimate fit_mmrf(const LagCovariance& statistic, const Support& support, NoiseForm noise,
                                   const MrfLeastSquaresOptions& options = {});

/// Least-squares PMRF estimate (theory 8.4; P4 2.7): the first iteration of fit_mmrf(), A_{−s} = A_sᵀ,
/// minimises mean_r Σ_i e_{r,i}²; Σ = mean_r e_r e_rᵀ, which is lag 0 of S_e = Σ^{1/2} Λ Σ^{1/2}, or its
/// diagonal. Consistent where Σ is a multiple of I. Arguments and errors as fit_mmrf()'s; per-pair sets go
/// with either form of the noise.
[[nodiscard]] MrfEstimate fit_pmrf(const LagCovariance& statistic, const Support& support, NoiseForm noise);

}  // namespace btfield::detail
