#pragma once

// Models of the residual, one to each region (theory 18.4; P1 2.3).

#include <string>
#include <vector>

#include "btfield/compound.hpp"
#include "btfield/device.hpp"

namespace btfield::detail {

struct RegionalFit {
    std::vector<TextureModel> residuals;
    std::vector<std::string> reasons;  ///< what was not as usual
};

/// Levels are estimated as if they had nothing in common, and near borders what is coarse comes from both
/// sides: see balance_levels() for what is done about that.
/// \param picture  which says what is large
/// \param residual the picture less its conditional mean; means of regions are about 0
/// \param local    as CompoundOptions::local
/// \param averages how those of families of moving averages are estimated
/// \throws InputError as fit_compound()
[[nodiscard]] RegionalFit fit_regions(Device& device, const Image& picture, const Image& residual,
                                      const ControlField& field, const FitOptions& local,
                                      AveragesEstimator averages);

}  // namespace btfield::detail
