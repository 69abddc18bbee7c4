#pragma once

#include <vector>

#include "btfield/image.hpp"

namespace btfield::peer {

/// y = Tᵀ q(x) + μ of three planes, in place. tables: per plane q_k and its step by turns; knots at equal
/// steps of ±3.5.
void restore(Image& planes, const std::vector<float>& tables, int knots, const std::vector<float>& basis,
             const std::vector<float>& mean);

}  // namespace btfield::peer
