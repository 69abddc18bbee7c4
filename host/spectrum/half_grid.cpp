#include "host/spectrum/half_grid.hpp"

#include <cmath>
#include <numbers>

namespace btfield::detail {

RootsOfUnity::RootsOfUnity(int n) {
    for (int k = 0; k < n; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / n;
        roots_.emplace_back(std::cos(angle), std::sin(angle));
    }
}

}  // namespace btfield::detail
