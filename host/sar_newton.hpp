#pragma once

#include <Eigen/Core>

#include "host/sar_objective.hpp"

namespace btfield {

struct Descent {
    Eigen::VectorXd x;
    double likelihood = 0.0;  ///< f(x) without the guard
    double value = 0.0;       ///< f(x)
    double gradient = 0.0;    ///< its largest entry
    int steps = 0;
    bool converged = false;
};

/// Newton's method with Armijo's rule from x, until a step would gain less than `tolerance`. Where the
/// Hessian is not positive definite, as much of 2 C_model(t − s) is added as makes it so.
[[nodiscard]] Descent descend(SarObjective& objective, Eigen::VectorXd x, double tolerance, int most_steps);

}  // namespace btfield
