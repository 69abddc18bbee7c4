#pragma once

// How far the values of regions are from each other (theory 18.2).

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "host/compound/cluster_features.hpp"

namespace btfield::detail {

struct RegionDistances {
    std::size_t fewest_pixels = 0;  ///< of a region
    double least = 0.0;             ///< of any two regions, in nats; 0 where one is empty
};

/// Symmetric Kullback-Leibler divergences of the normal distributions of the regions' values.
/// \param regions  at least 2
[[nodiscard]] RegionDistances region_distances(const PixelPlanes& planes,
                                               std::span<const std::uint8_t> labels, int regions);

}  // namespace btfield::detail
