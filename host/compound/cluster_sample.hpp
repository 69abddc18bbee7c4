#pragma once

// Few vectors that stand for all pixels in a search for centres (theory 18.1).

#include "host/compound/cluster_features.hpp"

namespace btfield::detail {

/// Pixels are halved, halves are halved again, each time at the median of the plane in which they spread
/// most, and so on; these are the means of the parts, which all have as many pixels. The pixels themselves of
/// a small picture; of a large one, those at random places in the cells of a lattice, so that no pattern of
/// the picture's meets the lattice's.
[[nodiscard]] PixelPlanes cluster_sample(const PixelPlanes& planes, Size size);

}  // namespace btfield::detail
