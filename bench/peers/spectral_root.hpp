#pragma once

#include <complex>
#include <vector>

namespace btfield::peer {

/// Root · W^{-1/2} of Hermitian matrices [matrix][i][j] by Eigen's solver, one after the other on every
/// thread. Planes: 1, 3, 6.
void mmrf_factors(int planes, const std::vector<std::complex<float>>& matrices,
                  const std::vector<float>& root, std::vector<std::complex<float>>& factors);

}  // namespace btfield::peer
