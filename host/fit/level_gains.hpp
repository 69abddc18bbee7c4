#pragma once

// The gains that make the sum of the pyramid's levels meet the picture's covariances.

#include <vector>

namespace btfield::detail {

/// One gain per level (theory 12.2): the non-negative g_k that minimise
///
///     Σ_i Σ_s w(s)² ((Σ_k g_k² C^k_ii(s) − C_ii(s)) / C_ii(0))²,  w = 3 at s = (0, 0), else 1.
///
/// \param levels expanded covariances of each level, [level][lag][i][j]
/// \param data   the picture's, [lag][i][j]; the first lag is (0, 0)
[[nodiscard]] std::vector<double> match_gains(const std::vector<std::vector<double>>& levels,
                                              const std::vector<double>& data, int planes);

}  // namespace btfield::detail
