#pragma once

#include "btfield/image.hpp"
#include "btfield/neighbourhood.hpp"

#include <vector>

namespace btfield::peer {

/// Covariances on the torus at all lags with 0 <= s1 <= box.row and |s2| <= box.column, means removed,
/// float64: [s1][s2 + box.column][i][j]. Lags (0, s2 < 0) are left zero: the others give them.
std::vector<double> lag_covariance(const Image& image, Offset box);

}  // namespace btfield::peer
