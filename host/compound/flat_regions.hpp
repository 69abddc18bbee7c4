#pragma once

// Regions of a picture that have one colour each.

#include <string>
#include <vector>

#include "btfield/control_field.hpp"
#include "btfield/fit.hpp"
#include "btfield/image.hpp"
#include "btfield/lag_covariance.hpp"
#include "btfield/models.hpp"

namespace btfield::detail {

/// Regions without a deviation worth a model in any plane.
/// \param deviations of the picture's planes
[[nodiscard]] std::vector<bool> flat_regions(const Image& residual, const ControlField& field,
                                             const std::vector<double>& deviations);

/// What is to be said of them; empty where there are none.
[[nodiscard]] std::string flat_reason(const std::vector<bool>& flat);

/// White noise of these variances, as a model of any family that is not moving averages.
[[nodiscard]] LevelModel white_level(Size size, const LagCovariance& statistic, const FitOptions& local,
                                     const Support& support);

}  // namespace btfield::detail
