#pragma once

#include <vector>

namespace btfield::peer {

/// MEMD of two pictures of three planes under the metric max, [pixel][plane] in units 0…255: the plain loop.
double memd_loop(const std::vector<float>& a, const std::vector<float>& b);

/// The same through a k-d tree with deletion (live counts, boxes as built), one thread.
double memd_tree(const std::vector<float>& a, const std::vector<float>& b);

}  // namespace btfield::peer
