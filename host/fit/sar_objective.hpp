#pragma once

// The likelihood of an MSAR model as a function of the free entries of B_t = Σ^{-1/2} Λ_t (theory 11.3).

#include <memory>
#include <vector>

#include "host/base/eigen.hpp"
#include "host/spectrum/inverse_spectrum.hpp"

namespace btfield::detail {

/// f(x) = Σ_{s,t} tr(b_s C(t − s) b_tᵀ) − 2 mean_t ln |det B_t| + ρ/2 Σ_i max(0, P_ii − τ)²,
/// B_t = Σ_s b_s e^{iω_t s}, P the covariance of the model at lag 0. The first two terms are minus twice the
/// log-likelihood per pixel, up to a constant; the last is the variance guard, for planes of variance one.
class SarObjective {
  public:
    using Index = Eigen::Index;
    struct Layout {
        int planes = 0;
        std::vector<Offset> terms;  ///< s of b_s, the centre first
        /// Unknown that entry (i, j) of b_s is, at [(s·d + i)·d + j]; −1 where it is zero. Entries may share
        /// one.
        std::vector<Index> place;
        Index unknowns = 0;
        /// Λ is real: the search stays where det B > 0, and there f is convex (d = 1).
        bool real = false;
    };

    /// \param moments C(t − s), rows and columns (s, j), j fastest
    SarObjective(Layout layout, Eigen::MatrixXd moments);

    /// Evaluates on a grid of side × side from now on.
    void set_grid(int side);
    [[nodiscard]] int side() const { return spectrum_->side(); }
    /// ρ and τ: with τ well above 1 the guard keeps away from singular models and leaves those that have the
    /// data's variance alone.
    struct Guard {
        double strength = 0.0;
        double tolerated = 2.0;
    };
    void set_guard(Guard guard) { guard_ = guard; }
    /// The guard is at work at the x of the last call of value().
    [[nodiscard]] bool is_guarded() const { return guard_.strength > 0.0 && excess_.maxCoeff() > 0.0; }
    [[nodiscard]] const Layout& layout() const { return layout_; }

    /// All entries of all b_s.
    [[nodiscard]] Eigen::VectorXd entries(const Eigen::VectorXd& x) const;

    /// f(x), infinite outside of its domain.
    [[nodiscard]] double value(const Eigen::VectorXd& x);
    /// f(x) without the guard, after value(x).
    [[nodiscard]] double likelihood() const { return likelihood_; }

    struct Derivatives {
        Eigen::VectorXd gradient;
        Eigen::MatrixXd hessian;  ///< its lower triangle
    };
    /// At the x of the last call of value(). The Hessian of the guard is Gauss-Newton's.
    [[nodiscard]] Derivatives derivatives() const { return differentiate(true); }
    /// The gradient alone.
    [[nodiscard]] Eigen::VectorXd gradient() const { return differentiate(false).gradient; }

  private:
    struct Fields;
    [[nodiscard]] Derivatives differentiate(bool twice) const;
    /// Without the guard.
    [[nodiscard]] Eigen::VectorXd likelihood_gradient(const LagMeans& means) const;
    /// ∂P_mm of every guarded plane, a column each.
    [[nodiscard]] Eigen::MatrixXd guard_slopes(const Fields& fields, const LagMeans& means) const;
    /// Second derivatives of −2 mean_t ln |det B_t|, lower triangle.
    [[nodiscard]] Eigen::MatrixXd logarithm_hessian(const Fields& fields, const LagMeans& means) const;
    void add_quadratic(Eigen::MatrixXd& hessian) const;

    Layout layout_;
    Eigen::MatrixXd moments_;
    Offset reach_;  ///< largest |s1|, |s2|
    std::unique_ptr<InverseSpectrum> spectrum_;
    Guard guard_;
    double likelihood_ = 0.0;
    Eigen::VectorXd b_;
    Eigen::VectorXd excess_;  ///< max(0, P_ii − τ)
};

}  // namespace btfield::detail
