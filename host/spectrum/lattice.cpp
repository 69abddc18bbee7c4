#include "host/spectrum/lattice.hpp"

#include <cmath>

#include "host/base/eigen.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::size_t;

}  // namespace

Reach correlation_reach(const HermitianPolynomial& q) {
    MatrixXd at_zero = q.centre, by_row = MatrixXd::Zero(q.planes(), q.planes()), by_column = by_row;
    for (size_t s = 0; s < q.offsets.size(); ++s) {
        const double row = q.offsets[s].row, column = q.offsets[s].column;
        const MatrixXd term = 0.5 * (q.terms[s] + q.terms[s].transpose());
        at_zero -= 2.0 * term;
        by_row += row * row * term;
        by_column += column * column * term;
    }
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(at_zero);
    Reach reach;
    for (Index k = 0; k < at_zero.rows(); ++k) {
        const VectorXd v = solver.eigenvectors().col(k);
        const double value = std::max(solver.eigenvalues()[k], 1e-300);
        reach.row = std::max(reach.row, std::sqrt(std::max(0.0, v.dot(by_row * v) / value)));
        reach.column = std::max(reach.column, std::sqrt(std::max(0.0, v.dot(by_column * v) / value)));
    }
    return reach;
}

GridDensity resolving(const HermitianPolynomial& q, GridDensity density) {
    const Reach reach = correlation_reach(q);
    const auto levels = [](double pixels) {
        return std::min(most_levels, static_cast<int>(std::ceil(0.5 * std::log2(pixels))));
    };
    density.row_levels = levels(reach.row);
    density.column_levels = levels(reach.column);
    return density;
}

}  // namespace btfield::detail
