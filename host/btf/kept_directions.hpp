#pragma once

// Pairs whose weights the others' can be made of (theory 21.3).

#include <cstdint>
#include <functional>
#include <vector>

#include "host/base/eigen.hpp"
#include "host/btf/direction_interpolation.hpp"

namespace btfield::detail {

struct KeptDirections {
    std::vector<std::uint32_t> pairs;  ///< ascending
    /// What the others' weights are off by when they are interpolated, as a share of the variance of their
    /// pictures; mean over all pairs.
    double error = 0.0;
};

/// Few pairs for which that is at most `bound`, more where weights vary more: spread over all directions,
/// then those added that are furthest from what the others say.
/// \param weights   [pair][values]: what is interpolated
/// \param variance  of each pair's picture, in the unit of squared weights
/// \param bound     0 keeps all
[[nodiscard]] KeptDirections keep_directions(const std::vector<DirectionPair>& pairs,
                                             const RowMajorMatrix& weights,
                                             const std::vector<double>& variance, double bound,
                                             const std::function<void(double share)>& progress = {});

}  // namespace btfield::detail
