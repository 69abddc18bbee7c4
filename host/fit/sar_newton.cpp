#include "host/fit/sar_newton.hpp"

#include <cmath>
#include <utility>

#include "host/base/dense.hpp"
#include "host/base/work_part.hpp"

namespace btfield::detail {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// (H + μI)⁻¹ with the least μ, up to a factor of four, for which that is positive definite. Saddle points
/// repel, and no eigenvalues are needed: they take ten times as long as the rest of a step on a thousand
/// unknowns.
class Inverse {
  public:
    explicit Inverse(const MatrixXd& hessian) : factor_(hessian) {
        if (factor_.positive()) return;
        indefinite_ = true;
        MatrixXd shifted = hessian;
        for (double shift = 1e-6; !factor_.positive() && std::isfinite(shift); shift *= 4.0) {
            shifted.diagonal() = hessian.diagonal().array() + shift;
            factor_ = Cholesky(shifted);
        }
    }
    [[nodiscard]] bool indefinite() const { return indefinite_; }
    [[nodiscard]] VectorXd apply(const VectorXd& g) const { return factor_.solve(g); }

  private:
    Cholesky factor_;
    bool indefinite_ = false;
};

/// a of the path x + t v + t² a that follows a curved valley: −½ H⁻¹ ∇³f[v, v] (Transtrum and Sethna's
/// geodesic acceleration), from the gradient a small way along v. Its part along v, in the metric of H, only
/// changes the pace: brisk steps leave it out, for where the valley is flat it is the largest by far.
VectorXd bend(SarObjective& objective, const VectorXd& x, const SarObjective::Derivatives& at,
              const Inverse& inverse, const VectorXd& step, Pace pace) {
    constexpr double way = 0.1;
    if (inverse.indefinite() || !std::isfinite(objective.value(x + way * step)))
        return VectorXd::Zero(x.size());
    const auto hessian = at.hessian.selfadjointView<Eigen::Lower>();
    const VectorXd linear = hessian * step;
    const VectorXd third = (objective.gradient() - at.gradient - way * linear) / (way * way);
    VectorXd result = -inverse.apply(third);
    const double limit = step.dot(linear);
    if (pace == Pace::brisk) result -= result.dot(linear) / limit * step;
    // Longer than the step itself it tells nothing.
    const VectorXd along = hessian * result;
    const double length = result.dot(along);
    if (!(length <= limit)) result *= std::sqrt(limit / length);
    if (!result.allFinite()) result.setZero();
    return result;
}

}  // namespace

Descent descend(SarObjective& objective, VectorXd x, double tolerance, int most_steps, Pace pace,
                const Admissible& admissible) {
    Descent result;
    result.x = std::move(x);
    result.value = objective.value(result.x);
    result.likelihood = objective.likelihood();
    if (!std::isfinite(result.value)) return result;
    for (;; ++result.steps) {
        work_nearer(share_of_step);
        const SarObjective::Derivatives at = objective.derivatives();
        result.gradient = at.gradient.cwiseAbs().maxCoeff();
        const Inverse inverse(at.hessian);
        const VectorXd step = -inverse.apply(at.gradient);
        const double slope = at.gradient.dot(step);
        result.converged = -0.5 * slope <= tolerance;
        if (result.converged || result.steps >= most_steps || !std::isfinite(slope)) return result;
        VectorXd curve = VectorXd::Zero(step.size());
        if (-0.5 * slope > 1e-12) curve = bend(objective, result.x, at, inverse, step, pace);
        // Differences of f below its own rounding decide nothing.
        const double rounding = 1e-14 * (1.0 + std::abs(result.value));
        double length = 1.0, value = 0.0;
        VectorXd next;
        for (;; length *= 0.5) {
            next = result.x + length * step + (length * length) * curve;
            value = objective.value(next);
            if (value <= result.value + 1e-4 * length * slope + rounding && (!admissible || admissible(next)))
                break;
            if (length < (admissible ? 1e-3 : 1e-8)) {
                (void)objective.value(result.x);
                return result;
            }
        }
        // On, as far as f falls, where it fell by more than its derivatives promise.
        for (bool further = pace == Pace::brisk && length == 1.0 && result.value - value > -0.75 * slope;
             further;) {
            const VectorXd there = result.x + 2.0 * length * step + (4.0 * length * length) * curve;
            const double lower = objective.value(there);
            further = lower < value;
            if (!further) {
                (void)objective.value(next);
                break;
            }
            length *= 2.0;
            value = lower;
            next = there;
        }
        result.x = std::move(next);
        result.value = value;
        result.likelihood = objective.likelihood();
    }
}

}  // namespace btfield::detail
