#pragma once

/// \file
/// The certificate of a level (theory 10): does its recursion define a stationary field, of the data's
/// variance?

#include "btfield/api.hpp"
#include "btfield/lag_covariance.hpp"
#include "btfield/models.hpp"

namespace btfield {

/// Examines Λ on a grid of 128 × 128, and on ever smaller squares where a bound on its change between the
/// points of evaluation can neither exclude a zero nor show that the spectrum is resolved (theory 10.3).
/// \param data of the level that the model was fitted to, in a box of any size: its lag 0 is the variance
///     that the model is held against
/// \throws InputError when the numbers of planes differ
[[nodiscard]] BTFIELD_API Certificate certify(const Model& model, const LagCovariance& data);

}  // namespace btfield
