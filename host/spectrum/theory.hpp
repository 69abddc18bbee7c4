#pragma once

// Moments of what a model's levels add up to, before marginals and basis are undone.

#include <span>
#include <vector>

#include "btfield/models.hpp"

namespace btfield::detail {

/// Covariances of the modelled planes on a texture of this size, gains included, averaged over positions:
/// [lag][i][j].
[[nodiscard]] std::vector<double> modelled_covariance(const TextureModel& model, Size size,
                                                      std::span<const Offset> lags);

}  // namespace btfield::detail
