#pragma once

/// \file
/// What a fitted texture model promises (theory 14.6): moments of the textures that it will grow, without
/// growing one.

#include <span>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/image.hpp"
#include "btfield/models.hpp"
#include "btfield/neighbourhood.hpp"

namespace btfield {

/// Covariances of a texture of this size under the model: levels on their own tori, expanded, with their
/// gains, averaged over positions. [lag][i][j] over the picture's planes, in squared units of its values. The
/// mean of the field is taken as known.
/// \throws InputError when the size is not positive or the model has no level
[[nodiscard]] BTFIELD_API std::vector<double> theoretical_covariance(const TextureModel& model, Size size,
                                                                     std::span<const Offset> lags);

/// Square roots of the diagonal of theoretical_covariance at lag 0: the standard deviation per plane.
/// \throws InputError as that does
[[nodiscard]] BTFIELD_API std::vector<double> theoretical_deviation(const TextureModel& model, Size size);

}  // namespace btfield
