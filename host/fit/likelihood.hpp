#pragma once

// The Gaussian likelihood of a level under its model, from what is known of the level (theory 11.1).

#include <cstddef>
#include <functional>
#include <string>

#include "btfield/lag_covariance.hpp"
#include "btfield/models.hpp"
#include "host/fit/folded_periodogram.hpp"

namespace btfield::detail {

/// Whittle log-likelihood per pixel, −½ (d ln 2π + mean_t ln det S_t + mean_t tr(S_t⁻¹ I_t)), I the
/// periodogram. From lag covariances where S⁻¹ has no lags beyond theirs: autoregressive models, MMRF, and
/// PMRF of one plane. Others read the periodogram. NaN where S is singular, as it is for a moving average
/// whose transfer function vanishes or whose noise is semidefinite.
/// \param mean_log_determinant mean_t ln |det Λ_t|
/// \param periodogram of the level, called when it is needed
/// \param first_plane of the level's planes, the one that is the model's first
[[nodiscard]] double log_likelihood(const Model& model, const LagCovariance& statistic,
                                    double mean_log_determinant,
                                    const std::function<const FoldedPeriodogram&()>& periodogram,
                                    int first_plane);

/// Newton's method on so many unknowns takes gigabytes and hours.
/// \param asked   what the user wants
/// \param instead what there is to do
/// \throws InputError beyond what a dense Hessian can have
void check_dense_hessian(const std::string& asked, std::size_t unknowns, const char* instead);

}  // namespace btfield::detail
