#pragma once

// Levels of regional models put in proportion to each other (theory 18.4).

#include <vector>

#include "btfield/compound.hpp"
#include "btfield/device.hpp"

namespace btfield::detail {

/// Variances of regions, [region][plane].
[[nodiscard]] std::vector<double> regional_variances(const Image& image, std::span<const std::uint8_t> labels,
                                                     int regions);

/// Labels of the pixels that a pyramid level's pixels were reduced to: every `step`-th row and column.
[[nodiscard]] std::vector<std::uint8_t> coarse_labels(const ControlField& field, int step);

/// Each level is grown on the sample's own labels. With GainMode::match, gains give what they add up to the
/// variances that the residual's levels have, region by region and, of moving averages, plane by plane: those
/// multiply their coefficients. Then it gets the residual's covariances at lag
/// 0, where there are marginals, and its variance elsewhere.
/// \param planes    what the regional models were fitted to
/// \param variances [level] of its pyramid, as regional_variances() has them
void balance_levels(Device& device, const Image& planes, const ControlField& field,
                    const std::vector<std::vector<double>>& variances, GainMode gains,
                    std::vector<TextureModel>& residuals);

}  // namespace btfield::detail
