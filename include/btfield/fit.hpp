#pragma once

/// \file
/// From a picture to a model (theory 2 to 13).

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/device.hpp"
#include "btfield/image.hpp"
#include "btfield/lag_covariance.hpp"
#include "btfield/models.hpp"

namespace btfield {

/// Which estimator to use. Of CAR models least squares is maximum likelihood where it certifies, so
/// `automatic` and `maximum_likelihood` are the same; moving averages have the random decrement estimate
/// alone.
enum class EstimatorChoice {
    /// Least squares where it certifies with a variance within 20 % of the data's, maximum likelihood where
    /// not, level by level (theory 11.7).
    automatic,
    least_squares,
    maximum_likelihood,
};
/// "auto", "ls", "ml".
[[nodiscard]] BTFIELD_API std::string_view name(EstimatorChoice choice);

/// Level gains (theory 12).
enum class GainMode { match, none };
[[nodiscard]] BTFIELD_API std::string_view name(GainMode mode);

/// Marginals (theory 13).
enum class MarginalMode { match, none };
[[nodiscard]] BTFIELD_API std::string_view name(MarginalMode mode);

/// Normal-Wishart prior of the CAR estimate (theory 6.2; P4 2.1, eq. 2, 5, 7, 12, 13), in units of pixels:
/// V_xx(0) = strength · diag(C_jj(0)), V_xy(0) = 0, V_yy(0) = 0, as if `strength` pixels with neighbours of
/// the planes' own variances, unrelated to anything, had been seen first; β = β(0) + M after the M pixels of
/// the level. With strength → 0 the coefficients are those of least squares; with strength → ∞ they vanish,
/// and Σ̂ = C(0) M / (β(0) + M). Rescaling a plane rescales the model and changes nothing else. The default
/// only mends exact dependence between planes.
struct BayesPrior {
    double strength = 1e-3;
    double beta0 = 2.0;  ///< β(0) > 1, degrees of freedom of the prior on Σ
};

/// Which pixels are significant (theory 9.2): those above ξ with neighbours below it.
enum class SignificanceRule {
    p4,  ///< at least one of the two row neighbours and at least one of the two column neighbours (P4 2.3)
    p1,  ///< at least one of the four (P1 2.3)
};

struct MaOptions {
    /// ξ, in standard deviations of the plane above its mean. Towards 0 the kernel gets narrower and noisier,
    /// beyond 1 it approaches the covariance itself, which is too wide for an impulse response.
    double threshold = 0.5;
    SignificanceRule rule = SignificanceRule::p4;
};

struct FitOptions {
    ModelKind model = ModelKind::car3d;
    /// Chooses the model instead: κ, with white at 1, decides between 2D and 3D (P4 3.1), BIC the rest
    /// (theory 16). See docs/selection.md for this and for the choices below; Provenance::reasons says why.
    bool choose_model = false;
    /// Hierarchical order 1 … 8; 0 chooses it by BIC.
    int order = 5;
    /// CAR: causal or unilateral (default: causal). MSAR: any (default: symmetric). Markov models: symmetric.
    /// Moving averages: any, and the centre (default: symmetric). `custom` takes `offsets`.
    std::optional<NeighbourhoodKind> neighbourhood;
    std::vector<Offset> offsets;
    /// N > 0 takes the place of `order` (theory 4.4; P3 3.1): of the neighbourhood of order 8, each level
    /// keeps the N offsets whose correlation |C_ii(s)| / C_ii(0), averaged over its planes, is largest, as a
    /// custom neighbourhood. Symmetric ones keep s and −s together: N is even.
    int correlated = 0;
    /// Per-pair sets for custom supports (theory 4.3), laid out as Support::active; empty = all. 3D
    /// models only.
    std::vector<std::uint8_t> active;
    /// Pyramid levels; 0 = as many as default_levels() says and the picture determines, and for CAR models
    /// fewer when some level's certificate fails.
    int levels = 0;
    /// Chooses by BIC from 1 to `levels`, or to default_levels() where that is 0.
    bool choose_levels = false;
    int factor = 2;
    EstimatorChoice estimator = EstimatorChoice::automatic;
    NoiseForm noise = NoiseForm::full;
    GainMode gains = GainMode::match;
    MarginalMode marginals = MarginalMode::match;
    BayesPrior prior;
    MaOptions moving_average;
    /// Called with stage names ("planes", "pyramid", "lag covariances", "fit", "gains") and the seconds each
    /// took; those of a level come once per level, and share out the time that levels took together. In the
    /// caller's thread, but of fit_all() in any and in several at a time; what it throws ends the fit.
    std::function<void(std::string_view stage, double seconds)> progress;
};

/// Levels that suit most pictures of this size (theory 2.4): the coarsest one keeps at least 32 pixels a
/// side; at most 5.
[[nodiscard]] BTFIELD_API int default_levels(Size size, int factor = 2);

/// A picture made ready for any number of fits, which share its planes, pyramids and lag covariances.
class BTFIELD_API Analysis {
  public:
    /// \param device is to outlive it
    /// \throws InputError when the picture is empty or holds NaN or infinities
    Analysis(Device& device, Image image);
    ~Analysis();
    Analysis(Analysis&&) noexcept;
    Analysis& operator=(Analysis&&) noexcept;

    [[nodiscard]] const Image& image() const;

    /// Fits every level. Deterministic, and independent of the fits before; those of larger orders first
    /// spare the lag covariances a second pass. A fit that throws spoils no other. May be called from any
    /// number of threads at a time.
    /// \throws InputError when picture or options cannot give a model: a constant picture, a constant plane
    ///     where planes are modelled as they are (3D without marginals), a level smaller than the support
    ///     (the message says how many levels fit), acausal CAR support, singular normal equations
    [[nodiscard]] TextureModel fit(const FitOptions& options = {});
    /// fit() of each, in this order, on all of the machine's cores and from one pass of lag covariances per
    /// level.
    /// \throws what the first of them that fails does, when all have ended
    [[nodiscard]] std::vector<TextureModel> fit_all(std::span<const FitOptions> options);

  private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

/// Analysis(device, image).fit(options).
[[nodiscard]] BTFIELD_API TextureModel fit(Device& device, const Image& image,
                                           const FitOptions& options = {});

/// Least-squares / Bayesian CAR estimate from lag covariances alone (theory 6.2; P4 eq. 2, 4-7, 12, 13).
/// \param support offsets before the centre in raster order, each once
/// \throws InputError when the support is empty, repeats an offset or is not causal, the statistic's box does
///     not hold its difference_box(), a plane is constant, strength < 0, beta0 <= 1, or the normal
///     equations are singular
[[nodiscard]] BTFIELD_API CarModel fit_car(const LagCovariance& statistic, const Support& support,
                                           NoiseForm noise, const BayesPrior& prior = {});

/// Least-squares MSAR estimate from lag covariances alone (theory 7.3; P4 eq. 30, 31). Inconsistent for
/// symmetric supports: see certify().
/// \param support any offsets but the centre, each once
/// \throws InputError as fit_car(), but for the order of the offsets
[[nodiscard]] BTFIELD_API SarModel fit_sar(const LagCovariance& statistic, const Support& support,
                                           NoiseForm noise);

}  // namespace btfield
