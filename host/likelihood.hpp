#pragma once

// The Gaussian likelihood of a level under its model, from what is known of the level.

#include "btfield/lag_covariance.hpp"
#include "btfield/models.hpp"

namespace btfield {

/// Whittle log-likelihood per pixel, −½ (d ln 2π + mean_t ln det S_t + mean_t tr(S_t⁻¹ I_t)), I the
/// periodogram. From lag covariances alone where S⁻¹ has no lags beyond them: autoregressive and MMRF models.
/// NaN for others. \param mean_log_determinant mean_t ln |det Λ_t|
[[nodiscard]] double log_likelihood(const Model& model, const LagCovariance& statistic,
                                    double mean_log_determinant);

}  // namespace btfield
