#include "host/analysis/lag_matrices.hpp"

namespace btfield::detail {

using Eigen::MatrixXd;

MatrixXd lag_zero(const LagCovariance& statistic) {
    const int d = statistic.planes();
    MatrixXd c(d, d);
    for (int i = 0; i < d; ++i) {
        for (int j = 0; j < d; ++j) c(i, j) = 0.5 * (statistic(i, j, {}) + statistic(j, i, {}));
    }
    return c;
}

MatrixXd lag_matrix(const LagCovariance& statistic, Offset s) {
    const int d = statistic.planes();
    MatrixXd c(d, d);
    for (int i = 0; i < d; ++i) {
        for (int j = 0; j < d; ++j) c(i, j) = statistic(i, j, s);
    }
    return c;
}

}  // namespace btfield::detail
