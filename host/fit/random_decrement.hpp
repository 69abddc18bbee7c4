#pragma once

// Moving-average models, estimated from the picture itself by random decrement (theory 9.2, 9.3; P4 2.3,
// 2.4; P1 2.3).

#include <cstdint>
#include <span>
#include <vector>

#include "btfield/fit.hpp"
#include "btfield/image.hpp"
#include "btfield/lag_covariance.hpp"
#include "btfield/models.hpp"

namespace btfield::detail {

/// Random decrement signature (P4 eq. 15, 17): the mean of y_i(r ⊕ s) − μ_i over the pixels r of the torus
/// that are significant for (i, j), at [(s·d + i)·d + j]. Significant for (i, j): plane j is above its ξ at
/// r, plane i is below its own at neighbours of r, as the rule says. So it is the response of plane i to an
/// impulse in plane j; P4 writes the two indices the other way round.
/// \param statistic of the same level: means and C(0) set the thresholds
/// \param inside the pixels of a region, one byte each: of no others are r and r ⊕ s taken, and 0 is the mean
///     over no pixel; empty: all
/// \throws InputError naming ξ when no pixel is significant for some pair, or when it is not a number
[[nodiscard]] std::vector<double> random_decrement(const Image& level, const LagCovariance& statistic,
                                                   const std::vector<Offset>& offsets,
                                                   const MaOptions& options,
                                                   std::span<const std::uint8_t> inside = {});

/// Moving average of the level: A_s the random decrement signature at the offsets and the centre, Σ_e such
/// that Σ_s A_s Σ_e A_sᵀ = C(0). Where no positive semidefinite Σ_e does that, the nearest solution with its
/// negative eigenvalues set to 0 (full) or the nearest one with no variance below 0 (diagonal), and each
/// plane's coefficients scaled such that its variance is right. A diagonal Σ_e whose variance of a plane
/// would be 0 keeps a millionth of the largest there, in planes of unit deviation.
/// \param support where an impulse shows; the centre may be among its offsets and is added where it is not.
///     Per-pair sets are not read
/// \param inside as random_decrement(); the statistic is that region's
/// \throws InputError when ξ leaves no significant pixel, a plane is constant, an offset is repeated, or
///     picture and statistic differ in size or planes
[[nodiscard]] MaModel fit_ma(const Image& level, const LagCovariance& statistic, const Support& support,
                             NoiseForm noise, const MaOptions& options = {},
                             std::span<const std::uint8_t> inside = {});

}  // namespace btfield::detail
