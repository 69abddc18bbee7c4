#pragma once

// Exact maximum likelihood of Markov random fields (theory 11.4 to 11.6).

#include <cstdint>
#include <optional>
#include <vector>

#include "btfield/lag_covariance.hpp"
#include "btfield/models.hpp"
#include "host/spectrum/examination.hpp"

namespace btfield::detail {

struct FoldedPeriodogram;

struct MrfLikelihoodOptions {
    /// Largest difference between model and data covariances at lags of the support and lag 0, relative to
    /// √(C_ii(0) C_jj(0)), that counts as converged. Below 1e-10 rounding is met.
    double tolerance = 1e-8;
    int max_iterations = 200;  ///< Newton steps
};

struct MrfLikelihoodFit {
    MrfModel model;
    /// −2 ln L per pixel without its constant d ln 2π: mean_t (tr(S_t⁻¹ I_t) − ln det S_t⁻¹).
    double objective = 0.0;
    double start_objective = 0.0;  ///< of the start, the same units
    int iterations = 0;
    bool converged = false;
    /// Weight of ½ mean_t tr(S_t²) that had to be added to the objective (planes scaled as for
    /// min_eigenvalue); mostly 0. Otherwise covariances fall short of the data's by those of waves longer
    /// than a few pictures.
    double penalty = 0.0;
    double gradient = 0.0;  ///< what `tolerance` bounds, on a grid finer than the last one used
    /// Proven for every frequency: Σ⁻¹ Λ_t (MMRF) or Λ_t (PMRF) is positive definite.
    bool certified = false;
    /// Least eigenvalue found of Q_t (MMRF; planes scaled so that the data's C(0) has unit eigenvalues, or
    /// unit variances when Σ is diagonal) or of Λ_t (PMRF).
    double min_eigenvalue = 0.0;
    std::vector<double> variance_ratio;      ///< per plane P_ii(0) / C_ii(0), infinite lattice
    std::optional<Examination> examination;  ///< of the model, where the fit had to examine it
};

/// MMRF by damped Newton steps on the convex problem
///   min tr(Q_0 C(0)) − 2 Σ_{s in half} tr(Q_s C(s)ᵀ) − mean_t ln det Q_t,
///   Q_t = Σ⁻¹ Λ_t = Q_0 − Σ_s Q_s e^{iω·s},
/// the mean being the integral over all frequencies, on grids refined until it is one to the tolerance. At
/// the optimum the model's covariances are the data's at every active pair of every lag of the support, and
/// at lag 0 (Σ diagonal: the variances). Planes that repeat each other are told apart by white noise of 1e-8
/// of the correlation's largest eigenvalue. Independent of the picture's size and of the number of threads.
/// \throws InputError when the support is not symmetric, does not fit the statistic's box, or a plane is
///     constant
[[nodiscard]] MrfLikelihoodFit fit_mmrf_ml(const LagCovariance& statistic, const Support& support,
                                           NoiseForm noise, const MrfLikelihoodOptions& options = {});

/// PMRF, S_t = Λ⁻¹ R Λ R Λ⁻¹ with R = Σ^{1/2}, by descent of the Whittle likelihood
///   mean_t tr(Λ R⁻¹ Λ⁻¹ R⁻¹ Λ I_t) − mean_t ln det Λ_t + ln det Σ,
/// the first mean over the picture's periodogram, the second an integral as for the MMRF. It is convex in the
/// A_s for given R⁻¹ and convex in R⁻¹ for given A_s (Xᴴ Λ⁻¹ X is jointly convex in X and Λ, and X = R⁻¹ Λ
/// is linear in either), but not in both together: Newton's method on all unknowns at once, the second
/// derivatives between the two groups scaled down as far as it takes to make the Hessian positive definite.
/// Start, always valid: independent single-plane fields (each a convex problem) of the KLT planes for full
/// noise, which turned back are a PMRF whose Σ commutes with C(0), and of the picture's own planes for
/// diagonal noise. A PMRF keeps its form under rotations of the planes only, so strongly correlated planes
/// ask for full noise. With one plane PMRF and MMRF are the same Gaussian field, and so are the fits;
/// `periodogram` is then not read.
/// \throws InputError as fit_mmrf_ml, and when the periodogram has other planes than the statistic
[[nodiscard]] MrfLikelihoodFit fit_pmrf_ml(const LagCovariance& statistic,
                                           const FoldedPeriodogram& periodogram, const Support& support,
                                           NoiseForm noise, const MrfLikelihoodOptions& options = {});

}  // namespace btfield::detail
