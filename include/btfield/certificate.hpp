#pragma once

/// \file
/// The guard of MODELS section 7: does the fitted recursion define a stationary field?

#include <variant>
#include <vector>

#include "btfield/lag_covariance.hpp"

namespace btfield {

struct CarModel;
struct SarModel;
struct MrfModel;
struct MaModel;
using Model = std::variant<CarModel, SarModel, MrfModel, MaModel>;

/// What the spectrum of one level's model says about it.
struct Certificate {
    /// Proven: det Λ has no zero on the whole torus, Λ_t is positive definite where the model is Markov, and
    /// every variance ratio is at most 10. Of a moving average, which is a field whatever its coefficients,
    /// the ratios alone.
    bool valid = false;
    /// min_t σ_min(Λ_t) over the grid and its refinement; of Markov models the smallest eigenvalue of the
    /// Hermitian Σ^{-1/2} Λ_t Σ^{1/2} (MMRF) or Λ_t (PMRF), below 0 when it is not definite; of a moving
    /// average that of its transfer function.
    double min_singular = 0.0;
    /// Zeros of det Λ on the frequency torus: point zeros by winding number, and where det Λ is real
    /// (symmetric coefficients, Markov models) the grid cells that the zero curve crosses. A model may be
    /// invalid without a zero: singular to six digits somewhere, or so close to it along a curve that nothing
    /// can be proven.
    int zeros = 0;
    /// Per plane, model variance / data variance, without the level gain. The variance is that of the
    /// infinite lattice, narrow peaks of the spectrum integrated to about 1 %; that of the 128 × 128 torus
    /// when there are zeros.
    std::vector<double> variance_ratio;
};

/// Examines Λ on a grid of 128 × 128, and on ever smaller squares where a bound on its change between the
/// points of evaluation can neither exclude a zero nor show that the spectrum is resolved. `data` gives the
/// variance that the model is held against (its lag 0). \throws InputError when the numbers of planes differ.
[[nodiscard]] Certificate certify(const Model& model, const LagCovariance& data);

}  // namespace btfield
