#include "bench/peers/car_fit.hpp"

#include <Eigen/Cholesky>

#include "bench/peers/lag_covariance.hpp"

namespace btfield::peer {

std::vector<double> fit_car(const Image& image, const std::vector<Offset>& offsets) {
    const Offset box = difference_box(offsets);
    const std::vector<double> covariance = lag_covariance(image, box);
    const int d = image.planes(), n = static_cast<int>(offsets.size());
    // C_ij(s) = E y_i(r) y_j(r + s), and C_ij(−s) = C_ji(s).
    const auto at = [&](int i, int j, int row, int column) {
        if (row < 0 || (row == 0 && column < 0)) {
            row = -row, column = -column;
            std::swap(i, j);
        }
        return covariance[static_cast<std::size_t>(
            ((row * (2 * box.column + 1) + column + box.column) * d + i) * d + j)];
    };
    Eigen::MatrixXd xx(n * d, n * d), xy(n * d, d);
    for (int s = 0; s < n; ++s)
        for (int i = 0; i < d; ++i) {
            const Offset a = offsets[static_cast<std::size_t>(s)];
            for (int t = 0; t < n; ++t)
                for (int j = 0; j < d; ++j) {
                    const Offset b = offsets[static_cast<std::size_t>(t)];
                    xx(s * d + i, t * d + j) = at(i, j, b.row - a.row, b.column - a.column);
                }
            for (int j = 0; j < d; ++j) xy(s * d + i, j) = at(i, j, -a.row, -a.column);
        }
    const Eigen::MatrixXd solved = xx.ldlt().solve(xy);
    std::vector<double> coefficients;
    coefficients.reserve(static_cast<std::size_t>(n * d * d));
    for (int s = 0; s < n; ++s)
        for (int i = 0; i < d; ++i)
            for (int j = 0; j < d; ++j) coefficients.push_back(solved(s * d + j, i));
    return coefficients;
}

}  // namespace btfield::peer
