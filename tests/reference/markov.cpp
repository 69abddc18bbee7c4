#include "tests/reference/markov.hpp"

#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <vector>

#include "tests/reference/algebra.hpp"
#include "tests/reference/fields.hpp"

namespace btfield::reference {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;

MatrixXcd lambda(const LinearField& field, double row, double column) {
    MatrixXcd value = MatrixXcd::Identity(field.planes, field.planes);
    for (std::size_t s = 0; s < field.offsets.size(); ++s) {
        value -= std::polar(1.0, row * field.offsets[s].row + column * field.offsets[s].column) *
                 coefficients(field, s);
    }
    return value;
}

MatrixXcd inverse_density(const MrfModel& model, double row, double column) {
    const MatrixXcd value = lambda(model, row, column);
    const MatrixXd sigma = noise_covariance(model);
    if (model.form == MrfForm::mmrf) return product(MatrixXcd(inverse(sigma)), value);
    const MatrixXcd root = symmetric_inverse_root(sigma);
    return product(product(product(value, root), inverse(value)), product(root, value));
}

LagCovariance covariances(const MrfModel& model, int side, Offset box) {
    LagCovariance result(model.planes, {side, side}, box);
    const int d = model.planes;
    const double unit = 2.0 * std::numbers::pi / side;
    std::vector<MatrixXd> sums(static_cast<std::size_t>((2 * box.row + 1) * (2 * box.column + 1)),
                               MatrixXd::Zero(d, d));
    for (int m = 0; m < side; ++m) {
        for (int n = 0; n < side; ++n) {
            const MatrixXcd density = inverse(inverse_density(model, unit * m, unit * n));
            std::size_t k = 0;
            for (int r = -box.row; r <= box.row; ++r) {
                for (int c = -box.column; c <= box.column; ++c, ++k)
                    sums[k] += (density.conjugate() * std::polar(1.0, unit * (m * r + n * c))).real();
            }
        }
    }
    std::size_t k = 0;
    for (int r = -box.row; r <= box.row; ++r) {
        for (int c = -box.column; c <= box.column; ++c, ++k) {
            for (int i = 0; i < d; ++i) {
                for (int j = 0; j < d; ++j)
                    result.set(i, j, {r, c}, sums[k](i, j) / (double{1} * side * side));
            }
        }
    }
    return result;
}

}  // namespace btfield::reference
