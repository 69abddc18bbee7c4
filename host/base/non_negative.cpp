#include "host/base/non_negative.hpp"

#include <algorithm>
#include <vector>

#include "host/base/decompositions.hpp"

namespace btfield::detail {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::size_t;

VectorXd non_negative_least_squares(const MatrixXd& a, const VectorXd& b) {
    const Index unknowns = a.cols();
    VectorXd x = VectorXd::Zero(unknowns);
    std::vector<bool> free(static_cast<size_t>(unknowns), false);
    const double scale = (a.transpose() * b).cwiseAbs().maxCoeff();
    const auto solve_free = [&] {
        std::vector<Index> used;
        for (Index k = 0; k < unknowns; ++k) {
            if (free[static_cast<size_t>(k)]) used.push_back(k);
        }
        MatrixXd columns(a.rows(), static_cast<Index>(used.size()));
        for (size_t k = 0; k < used.size(); ++k) columns.col(static_cast<Index>(k)) = a.col(used[k]);
        const VectorXd part = least_norm_solution(columns, b);
        VectorXd full = VectorXd::Zero(unknowns);
        for (size_t k = 0; k < used.size(); ++k) full[used[k]] = part[static_cast<Index>(k)];
        return full;
    };
    // Each round frees one unknown and the objective falls: it ends. The bound only guards against rounding.
    for (Index round = 0; round < 3 * unknowns; ++round) {
        const VectorXd descent = a.transpose() * (b - a * x);
        Index best = -1;
        for (Index k = 0; k < unknowns; ++k) {
            if (free[static_cast<size_t>(k)] || !(descent[k] > 1e-12 * scale)) continue;
            if (best < 0 || descent[k] > descent[best]) best = k;
        }
        if (best < 0) break;
        free[static_cast<size_t>(best)] = true;
        VectorXd target = solve_free();
        for (;;) {
            // As far towards the unconstrained solution as no unknown turns negative.
            double fraction = 1.0;
            for (Index k = 0; k < unknowns; ++k) {
                if (free[static_cast<size_t>(k)] && !(target[k] > 0.0)) {
                    fraction = std::min(fraction, x[k] / (x[k] - target[k]));
                }
            }
            if (!(fraction < 1.0)) break;
            x += fraction * (target - x);
            for (Index k = 0; k < unknowns; ++k) {
                if (free[static_cast<size_t>(k)] && !(target[k] > 0.0) && !(x[k] > 1e-15 * x.maxCoeff())) {
                    free[static_cast<size_t>(k)] = false;
                    x[k] = 0.0;
                }
            }
            target = solve_free();
        }
        x = target;
    }
    return x;
}

}  // namespace btfield::detail
