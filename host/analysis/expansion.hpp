#pragma once

// Covariances of pyramid levels seen at full resolution (theory 12.1).

#include <span>
#include <vector>

#include "btfield/lag_covariance.hpp"

namespace btfield::detail {

/// Kernel e of `depth` expansions in a row, one axis: a level's value contributes e(r − n^depth q) to pixel
/// r. Odd length, centred. depth = 0 is {1}.
[[nodiscard]] std::vector<double> composed_expand_kernel(int factor, int depth);

/// R(N m) / N for m = 0, 1, …: with these, of both axes, covariances C_y(m) count in the variance of the
/// expansion. Their sum over all m is 1.
[[nodiscard]] std::vector<double> expansion_weights(int factor, int depth);

/// Box of level lags that expanded_covariance reads for these full-resolution lags.
[[nodiscard]] Offset expansion_box(int factor, int depth, std::span<const Offset> lags);

/// Covariances of the expansion z(r) = Σ_q e(r − N q) y(q), N = n^depth, averaged over the N² phases of r:
/// C_z(s) = N⁻² Σ_m C_y(m) R(s1 − N m1) R(s2 − N m2), R(u) = Σ_r e(r) e(r + u). [lag][i][j].
/// Exact on tori whose sides are multiples of N; elsewhere the seam is neglected.
/// Precondition: the level's box holds expansion_box(factor, depth, lags).
[[nodiscard]] std::vector<double> expanded_covariance(const LagCovariance& level, int factor, int depth,
                                                      std::span<const Offset> lags);

}  // namespace btfield::detail
