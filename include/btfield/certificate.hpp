#pragma once

/// \file
/// The guard of MODELS section 7: does the fitted recursion define a stationary field?

#include <vector>

#include "btfield/lag_covariance.hpp"

namespace btfield {

struct LinearField;

/// What the spectrum of one level's model says about it.
struct Certificate {
    /// Proven: det Λ has no zero on the whole torus, and every variance ratio is at most 10.
    bool valid = false;
    double min_singular = 0.0;  ///< min_t σ_min(Λ_t) over the grid and its refinement
    /// Zeros of det Λ on the frequency torus: point zeros by winding number, and for real d = 1 Λ the grid
    /// cells that the zero curve crosses. A model may be invalid without a zero: singular to six digits
    /// somewhere, or so close to it along a curve that nothing can be proven.
    int zeros = 0;
    /// Per plane, model variance / data variance, without the level gain. The variance is that of the
    /// infinite lattice, narrow peaks of the spectrum integrated to about 1 %; that of the 128 × 128 torus
    /// when there are zeros.
    std::vector<double> variance_ratio;
};

/// Examines Λ on a grid of 128 × 128, and on ever smaller squares where a bound on its change between the
/// points of evaluation can neither exclude a zero nor show that the spectrum is resolved. `data` gives the
/// variance that the model is held against (its lag 0). \throws InputError when the numbers of planes differ.
[[nodiscard]] Certificate certify(const LinearField& field, const LagCovariance& data);

}  // namespace btfield
