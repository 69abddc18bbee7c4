#pragma once

// Roots of small Hermitian matrices and the factors of Markov random fields in float64, by Eigen.

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <complex>

#include "btfield/models.hpp"
#include "tests/reference/spectral_factor.hpp"

namespace btfield::reference {

/// Σ^{1/2}, the symmetric root.
inline Eigen::MatrixXd symmetric_root(const Eigen::MatrixXd& covariance) {
    return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(covariance).operatorSqrt();
}

/// A^{1/2}, Hermitian.
inline Eigen::MatrixXcd hermitian_root(const Eigen::MatrixXcd& a) {
    return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXcd>(a).operatorSqrt();
}

inline Eigen::MatrixXcd hermitian_inverse_root(const Eigen::MatrixXcd& a) {
    return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXcd>(a).operatorInverseSqrt();
}

/// MMRF: root · W^{-1/2}, W = root⁻¹ Λ root (P4 2.6 up to a unitary factor on the right).
inline Eigen::MatrixXcd mmrf_factor(const Eigen::MatrixXcd& w, const Eigen::MatrixXd& root) {
    return root.cast<std::complex<double>>() * hermitian_inverse_root(w);
}

/// PMRF: Λ⁻¹ root Λ^{1/2} (P4 2.7).
inline Eigen::MatrixXcd pmrf_factor(const Eigen::MatrixXcd& lambda, const Eigen::MatrixXd& root) {
    return lambda.fullPivLu().solve(root.cast<std::complex<double>>() * hermitian_root(lambda));
}

}  // namespace btfield::reference
