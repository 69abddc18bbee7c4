#pragma once

// Exact maximum likelihood for MSAR models (theory 11.3; the model is P4 2.5).

#include <cstdint>
#include <vector>

#include "btfield/lag_covariance.hpp"
#include "btfield/models.hpp"
#include "host/spectrum/examination.hpp"

namespace btfield::detail {

struct LikelihoodOptions {
    /// Newton steps of one descent after which it is given up.
    int most_steps = 300;
    /// Ask for standard errors of the coefficients.
    bool standard_errors = false;
};

struct SarLikelihoodFit {
    SarModel model;
    /// What `examine` says of the model.
    Examination examination;
    /// Whittle log-likelihood per pixel, natural logarithm; NaN when the certificate fails.
    double log_likelihood = 0.0;
    int iterations = 0;      ///< Newton steps, those of all starts together
    bool converged = false;  ///< the gradient vanishes
    double gradient = 0.0;   ///< its largest entry, planes in units of their standard deviation
    int grid = 0;            ///< side of the frequency grid of the last steps
    bool guarded = false;  ///< the variance guard stayed on: its optimum certifies and the free one does not
    /// Of the coefficients, laid out as they are, from the inverse Hessian; empty unless asked for.
    std::vector<double> standard_errors;
};

/// Reads the data through the lag covariances alone. Planes that repeat each other are told apart by white
/// noise of 1e-8 of the correlation's largest eigenvalue. Descents start from white noise, then, as long as
/// they end at zeros of det Λ, from causal models; the last one goes through valid models only, so that its
/// end is valid but perhaps no optimum.
/// \throws InputError as fit_sar() does, and for per-pair sets with full noise unless every equation's sets
///     hold those of the equations above it: Σ^{-1/2} Λ has no zeros to keep then
[[nodiscard]] SarLikelihoodFit fit_sar_likelihood(const LagCovariance& statistic, const Support& support,
                                                  NoiseForm noise, const LikelihoodOptions& options = {});

}  // namespace btfield::detail
