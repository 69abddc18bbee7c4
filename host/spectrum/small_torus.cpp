#include "host/spectrum/small_torus.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "host/analysis/expansion.hpp"
#include "host/spectrum/frequency_grid.hpp"
#include "host/spectrum/half_grid.hpp"
#include "host/spectrum/spectral_density.hpp"

namespace btfield::detail {
namespace {

/// From this side on a level is taken as it is.
constexpr int small_side = 32;
/// Of the variance: sums that are nearer to the integral are taken as they are.
constexpr double near_enough = 0.02;

/// Of the infinite lattice: integrals to 1e-3 for fields that correlate over less than some hundred pixels.
FrequencyGrid dense_grid() {
    constexpr int levels = 4;
    return clustered_grid({.row_levels = levels, .column_levels = levels});
}

FrequencyGrid own_frequencies(Size torus) {
    FrequencyGrid grid;
    for (int m = 0; m < half_rows(torus.height); ++m) {
        grid.row.push_back(2.0 * std::numbers::pi * m / torus.height);
        grid.row_weight.push_back(static_cast<double>(row_weight(m, torus.height)) / torus.height);
    }
    for (int n = 0; n < torus.width; ++n) grid.column.push_back(2.0 * std::numbers::pi * n / torus.width);
    grid.column_weight.assign(grid.column.size(), 1.0 / torus.width);
    return grid;
}

/// Σ_m w_m e^{iωm} over m of both signs.
double response(const std::vector<double>& weights, double frequency) {
    double sum = weights.front();
    for (std::size_t m = 1; m < weights.size(); ++m)
        sum += 2.0 * weights[m] * std::cos(static_cast<double>(m) * frequency);
    return sum;
}

/// Of the expanded field.
/// \param seen expansion_weights()
Eigen::MatrixXd variance(const SpectralForm& form, FrequencyGrid grid, const std::vector<double>& seen) {
    for (std::size_t n = 0; n < grid.column.size(); ++n)
        grid.column_weight[n] *= response(seen, grid.column[n]);
    SpectralRow row(form, grid.column);
    const int d = form.planes();
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(d, d);
    for (std::size_t m = 0; m < grid.row.size(); ++m) {
        row.evaluate(grid.row[m]);
        row.evaluate_density();
        const double weight = grid.row_weight[m] * response(seen, grid.row[m]);
        for (int i = 0; i < d; ++i)
            for (int j = i; j < d; ++j) {
                const double* const density = row.density(i, j);
                double own = 0.0;
                for (std::size_t n = 0; n < grid.column.size(); ++n)
                    own += grid.column_weight[n] * density[n];
                sum(i, j) += weight * own;
            }
    }
    return sum.selfadjointView<Eigen::Upper>();
}

/// The nearest positive semidefinite matrix.
Eigen::MatrixXd without_negative(const Eigen::MatrixXd& matrix) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
    return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).asDiagonal() *
           solver.eigenvectors().transpose();
}

}  // namespace

Eigen::MatrixXd density_at_zero(const SpectralForm& form) {
    return variance(form, {{0.0}, {1.0}, {0.0}, {1.0}}, {1.0});
}

std::optional<Eigen::MatrixXd> mean_density(const SpectralForm& form, Size torus, int factor, int depth) {
    if (std::min(torus.height, torus.width) >= small_side) return std::nullopt;
    const std::vector<double> seen = expansion_weights(factor, depth);
    const Eigen::MatrixXd wanted = variance(form, dense_grid(), seen);
    const Eigen::MatrixXd lacking = wanted - variance(form, own_frequencies(torus), seen);
    const Eigen::ArrayXd share = lacking.diagonal().array().abs() / wanted.diagonal().array();
    if (!(share > near_enough).any()) return std::nullopt;
    return without_negative(density_at_zero(form) + static_cast<double>(area(torus)) * lacking);
}

}  // namespace btfield::detail
