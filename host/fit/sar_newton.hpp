#pragma once

#include <functional>

#include "host/base/eigen.hpp"
#include "host/fit/sar_objective.hpp"

namespace btfield::detail {

struct Descent {
    Eigen::VectorXd x;
    double likelihood = 0.0;  ///< f(x) without the guard
    double value = 0.0;       ///< f(x)
    double gradient = 0.0;    ///< its largest entry
    int steps = 0;
    bool converged = false;
};

/// How far a step goes.
enum class Pace {
    brisk,     ///< along the bend of a flat valley, and on as long as f falls by more than foreseen
    cautious,  ///< no further than a step of Newton's, and less where the valley bends
};

/// Whether a point may be the next; a step that ends at another is shortened.
using Admissible = std::function<bool(const Eigen::VectorXd& x)>;

/// Newton's method with Armijo's rule from x, until a step would gain less than `tolerance`. Where the
/// Hessian is not positive definite, its diagonal is raised: saddle points repel.
[[nodiscard]] Descent descend(SarObjective& objective, Eigen::VectorXd x, double tolerance, int most_steps,
                              Pace pace, const Admissible& admissible = {});

}  // namespace btfield::detail
