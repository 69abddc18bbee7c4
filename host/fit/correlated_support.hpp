#pragma once

// Neighbourhoods of the offsets that the data correlate with most (theory 4.4; P3 3.1).

#include <string>
#include <vector>

#include "btfield/lag_covariance.hpp"
#include "host/fit/level_fit.hpp"

namespace btfield::detail {

/// Offsets of order 8 of this kind.
/// \throws InputError when `count` of them cannot be kept: fewer than one, more than there are, an odd number
///     of a symmetric kind, or a custom kind
[[nodiscard]] std::vector<Offset> correlated_candidates(NeighbourhoodKind kind, int count);

struct CorrelatedSupport {
    Support support;  ///< custom, in raster order; per-pair sets as they were, for the estimators to judge
    double weakest_kept = 0.0;
};

/// The `count` candidates s with the largest mean over planes i of |C_ii(s)| / C_ii(0); those first in raster
/// order among equals. A centre among the candidates is kept beside them. Of symmetric candidates s and −s
/// stay together. Precondition: correlated_candidates() allows `count`, the statistic holds the candidates.
[[nodiscard]] CorrelatedSupport correlated_support(const LagCovariance& statistic, const Support& candidates,
                                                   int count);

/// The sentence for Provenance::reasons.
/// \param weakest of each level
[[nodiscard]] std::string correlated_reason(int count, NeighbourhoodKind kind,
                                            const std::vector<Offset>& candidates,
                                            const std::vector<double>& weakest);

}  // namespace btfield::detail
