#pragma once

// Lag covariances of regions: of pairs of pixels that lie in one region (theory 18.4).

#include <cstdint>
#include <span>
#include <vector>

#include "btfield/image.hpp"
#include "btfield/lag_covariance.hpp"

namespace btfield::detail {

/// What a sum over pairs is divided by.
enum class PairCount {
    pairs,  ///< their own number: without bias, but the covariances of a thin region may be those of no field
    pixels,  ///< the region's pixels: those of the field that is the region's deviations and 0 outside
};

/// C^k_ij(s) of every region k, on the torus, about the region's own means. Lags at which a region has no
/// pair have 0.
/// \param labels one per pixel, below `regions`
[[nodiscard]] std::vector<LagCovariance> regional_covariances(const Image& image,
                                                              std::span<const std::uint8_t> labels,
                                                              int regions, Offset box, PairCount count);

}  // namespace btfield::detail
