#pragma once

#include <vector>

#include "btfield/image.hpp"

namespace btfield::peer {

/// Laplacian levels, factor 2. Sides must be divisible by 2^(levels − 1).
std::vector<Image> decompose(const Image& image, int levels);

/// Adds the expanded coarse plane to rows [begin, end) of the fine one, which is twice as high and wide.
void add_expanded(const float* coarse, Size coarse_size, float* fine, int begin, int end);

}  // namespace btfield::peer
