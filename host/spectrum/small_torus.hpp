#pragma once

// Fields on tori that are small against the reach of their correlations (theory 14.3).

#include <optional>

#include "host/base/eigen.hpp"
#include "host/spectrum/spectral_form.hpp"

namespace btfield::detail {

/// S at frequency 0 with which a level's field, expanded `depth` times, has on a torus the variance that it
/// has on the infinite lattice: the frequencies of a small torus fall on the peak at 0 or beside it, and the
/// sum over them is not the integral. Nothing where both sides are long enough, or the sum is near the
/// integral. Positive semidefinite. Precondition: the field has a certificate that holds.
[[nodiscard]] std::optional<Eigen::MatrixXd> mean_density(const SpectralForm& form, Size torus, int factor,
                                                          int depth);

/// S at frequency 0 of the infinite lattice.
[[nodiscard]] Eigen::MatrixXd density_at_zero(const SpectralForm& form);

}  // namespace btfield::detail
