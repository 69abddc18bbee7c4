#pragma once

/// \file
/// The guard (theory 10): does the fitted recursion define a stationary field?

#include "btfield/api.hpp"
#include "btfield/lag_covariance.hpp"
#include "btfield/models.hpp"

namespace btfield {

/// Examines Λ on a grid of 128 × 128, and on ever smaller squares where a bound on its change between the
/// points of evaluation can neither exclude a zero nor show that the spectrum is resolved. `data` gives the
/// variance that the model is held against (its lag 0). \throws InputError when the numbers of planes differ.
[[nodiscard]] BTFIELD_API Certificate certify(const Model& model, const LagCovariance& data);

}  // namespace btfield
