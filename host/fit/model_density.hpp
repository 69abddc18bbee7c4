#pragma once

// What a fitted texture model says of the full-resolution planes that it models (theory 16.2).

#include <vector>

#include "btfield/models.hpp"
#include "host/fit/folded_periodogram.hpp"

namespace btfield::detail {

/// Whittle log-likelihood of the modelled planes, −½ Σ_t (d ln 2π + ln det S_t + tr(S_t⁻¹ I_t)) per pixel,
/// over all frequencies but 0, whose I_t removing the means has emptied. The density is that of what the
/// levels add up to, gains and whitening M included, averaged over phases as level_gains.hpp has it: S_t = M
/// Σ_k g_k² n^−2k |E_k(ω1)|² |E_k(ω2)|² S_k(n^k ω) Mᵀ, E_k the transform of the composed expansion kernel.
/// NaN where S is not positive definite.
/// \param periodogram of the modelled planes
[[nodiscard]] double picture_log_likelihood(const TextureModel& model, const FoldedPeriodogram& periodogram);

/// Mean over the picture's planes i and the lags s of |C_ii(s) − P_ii(s)| / C_ii(0), C the picture's
/// covariances, P the model's, marginals and basis undone.
/// \param data covariances_at() of the picture at these lags
[[nodiscard]] double lag_covariance_error(const TextureModel& model, const std::vector<Offset>& lags,
                                          const std::vector<double>& data);

}  // namespace btfield::detail
