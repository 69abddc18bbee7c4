#pragma once

// k-means, the same for any number of threads (theory 18.1).

#include <cstddef>
#include <cstdint>
#include <vector>

#include "host/compound/cluster_features.hpp"

namespace btfield::detail {

inline constexpr int most_means = 128;

/// [region][plane]: the best of several starts. Some are the same for all seeds, and win where the others
/// are hardly better: seeds agree about most pictures.
[[nodiscard]] std::vector<float> k_means_centres(const PixelPlanes& sample, int regions, std::uint64_t seed);

/// The nearest centre of each pixel, after some iterations over all. A region is empty only where there are
/// fewer different pixels than regions.
/// \param regions  1 to most_means
[[nodiscard]] std::vector<std::uint8_t> k_means_labels(const PixelPlanes& planes, std::vector<float> centres,
                                                       int regions, int iterations);

}  // namespace btfield::detail
