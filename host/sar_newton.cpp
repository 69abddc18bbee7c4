#include "host/sar_newton.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>

namespace btfield {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

}  // namespace

Descent descend(SarObjective& objective, VectorXd x, double tolerance, int most_steps) {
    static const bool verbose = std::getenv("MSAR_V") != nullptr;
    Descent result;
    result.x = std::move(x);
    result.value = objective.value(result.x);
    result.likelihood = objective.likelihood();
    if (!std::isfinite(result.value)) return result;
    for (;; ++result.steps) {
        const SarObjective::Derivatives at = objective.derivatives();
        result.gradient = at.gradient.cwiseAbs().maxCoeff();
        const Eigen::LLT<MatrixXd> factor(at.hessian);
        const bool convex = factor.info() == Eigen::Success;
        VectorXd step;
        int negative = 0;
        if (convex) {
            step = -factor.solve(at.gradient);
        } else {
            const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(at.hessian);
            const VectorXd along = solver.eigenvectors().transpose() * at.gradient;
            negative = static_cast<int>((solver.eigenvalues().array() < 0.0).count());
            step = -(solver.eigenvectors() * along.cwiseQuotient(solver.eigenvalues().cwiseAbs().cwiseMax(1e-6)));
        }
        const double slope = at.gradient.dot(step);
        if (!std::isfinite(slope)) return result;
        if (-0.5 * slope <= tolerance) {
            result.converged = true;
            return result;
        }
        if (result.steps >= most_steps) return result;
        double length = 1.0, value = 0.0;
        VectorXd next;
        // Differences of f below its own rounding decide nothing.
        const double rounding = 1e-14 * (1.0 + std::abs(result.value));
        for (;; length *= 0.5) {
            next = result.x + length * step;
            value = objective.value(next);
            if (value <= result.value + 1e-4 * length * slope + rounding) break;
            if (length < 1e-8) {
                (void)objective.value(result.x);
                return result;
            }
        }
        if (verbose)
            std::printf("   %3d f %.8f like %.8f |g| %.1e dec %.1e len %g neg %d\n", result.steps, value,
                        objective.likelihood(), result.gradient, -0.5 * slope, length, negative);
        result.x = std::move(next);
        result.value = value;
        result.likelihood = objective.likelihood();
    }
}

}  // namespace btfield
