#pragma once

// Moving averages from the covariances of a region (theory 18.4).

#include "btfield/lag_covariance.hpp"
#include "btfield/models.hpp"
#include "btfield/neighbourhood.hpp"

namespace btfield::detail {

/// The moving average of white noise of variance 1 whose coefficients are, on the support and its centre,
/// those of the symmetric root of the spectral density, negative eigenvalues of which count as 0; then
/// multiplied by the symmetric matrix that gives it the statistic's C(0).
/// \param statistic covariances in a box that holds the support; none beyond it
/// \throws InputError when a plane has no variance or the spectrum no root
[[nodiscard]] MaModel averages_of_covariances(const LagCovariance& statistic, const Support& support);

}  // namespace btfield::detail
