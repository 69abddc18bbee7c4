#pragma once

// Markov random fields frequency by frequency, as P4 2.6 and 2.7 write them, in float64.

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <complex>
#include <numbers>

#include "btfield/models.hpp"

namespace btfield::reference {

using Complex = std::complex<double>;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;

inline MatrixXd real_matrix(const std::vector<double>& values, std::size_t place, int d) {
    MatrixXd m(d, d);
    for (int i = 0; i < d; ++i) {
        for (int j = 0; j < d; ++j)
            m(i, j) = values[(place * static_cast<std::size_t>(d) + static_cast<std::size_t>(i)) *
                                 static_cast<std::size_t>(d) +
                             static_cast<std::size_t>(j)];
    }
    return m;
}

/// Λ_t = I − Σ_s A_s e^{iω·s}
inline MatrixXcd lambda(const LinearField& field, double row, double column) {
    MatrixXcd value = MatrixXcd::Identity(field.planes, field.planes);
    for (std::size_t s = 0; s < field.offsets.size(); ++s) {
        value -= std::polar(1.0, row * field.offsets[s].row + column * field.offsets[s].column) *
                 real_matrix(field.coefficients, s, field.planes);
    }
    return value;
}

/// S_t⁻¹: Σ⁻¹ Λ for the MMRF, Λ Σ^{−1/2} Λ⁻¹ Σ^{−1/2} Λ for the PMRF.
inline MatrixXcd inverse_density(const MrfModel& model, double row, double column) {
    const MatrixXcd value = lambda(model, row, column);
    const MatrixXd sigma = real_matrix(model.noise_covariance, 0, model.planes);
    if (model.form == MrfForm::mmrf) return sigma.inverse() * value;
    const MatrixXd root = Eigen::SelfAdjointEigenSolver<MatrixXd>(sigma).operatorInverseSqrt();
    return value * root * value.inverse() * root * value;
}

/// C(s) of the field: mean over a grid of side × side frequencies of conj(S_t) e^{iω·s}.
inline LagCovariance covariances(const MrfModel& model, int side, Offset box) {
    LagCovariance result(model.planes, {side, side}, box);
    const int d = model.planes;
    const double unit = 2.0 * std::numbers::pi / side;
    std::vector<MatrixXd> sums(static_cast<std::size_t>((2 * box.row + 1) * (2 * box.column + 1)),
                               MatrixXd::Zero(d, d));
    for (int m = 0; m < side; ++m) {
        for (int n = 0; n < side; ++n) {
            const MatrixXcd density = inverse_density(model, unit * m, unit * n).inverse();
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
