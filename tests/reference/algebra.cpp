#include "tests/reference/algebra.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

namespace btfield::reference {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

/// [Re a, −Im a; Im a, Re a]: its products, roots and inverses are those of a.
MatrixXd real_form(const MatrixXcd& a) {
    const Eigen::Index n = a.rows();
    MatrixXd m(2 * n, 2 * n);
    for (Eigen::Index j = 0; j < n; ++j)
        for (Eigen::Index i = 0; i < n; ++i) {
            m(i, j) = m(n + i, n + j) = a(i, j).real();
            m(n + i, j) = a(i, j).imag();
            m(i, n + j) = -a(i, j).imag();
        }
    return m;
}

MatrixXcd complex_form(const MatrixXd& m) {
    const Eigen::Index n = m.rows() / 2;
    MatrixXcd a(n, n);
    for (Eigen::Index j = 0; j < n; ++j)
        for (Eigen::Index i = 0; i < n; ++i) a(i, j) = {m(i, j), m(n + i, j)};
    return a;
}

}  // namespace

MatrixXd product(const MatrixXd& a, const MatrixXd& b) {
    return a * b;
}

MatrixXcd product(const MatrixXcd& a, const MatrixXcd& b) {
    return a * b;
}

VectorXd product(const MatrixXd& a, const VectorXd& b) {
    return a * b;
}

VectorXcd product(const MatrixXcd& a, const VectorXcd& b) {
    return a * b;
}

MatrixXd product(const MatrixXd& a, const MatrixXd& b, const MatrixXd& c) {
    return product(product(a, b), c);
}

MatrixXd congruent(const MatrixXd& a, const MatrixXd& m) {
    return product(product(a, m), MatrixXd(a.transpose()));
}

MatrixXd inverse(const MatrixXd& a) {
    return a.inverse();
}

MatrixXcd inverse(const MatrixXcd& a) {
    return a.inverse();
}

MatrixXcd solution(const MatrixXcd& a, const MatrixXcd& b) {
    return a.fullPivLu().solve(b);
}

MatrixXd lower_root(const MatrixXd& a) {
    return a.llt().matrixL();
}

double log_determinant(const MatrixXcd& a) {
    const Eigen::LLT<MatrixXcd> factor(a);
    double sum = 0.0;
    for (Eigen::Index i = 0; i < a.rows(); ++i) sum += 2.0 * std::log(factor.matrixLLT()(i, i).real());
    return sum;
}

MatrixXd symmetric_root(const MatrixXd& a) {
    return Eigen::SelfAdjointEigenSolver<MatrixXd>(a).operatorSqrt();
}

MatrixXd symmetric_inverse_root(const MatrixXd& a) {
    return Eigen::SelfAdjointEigenSolver<MatrixXd>(a).operatorInverseSqrt();
}

MatrixXcd hermitian_root(const MatrixXcd& a) {
    return complex_form(symmetric_root(real_form(a)));
}

MatrixXcd hermitian_inverse_root(const MatrixXcd& a) {
    return complex_form(symmetric_inverse_root(real_form(a)));
}

MatrixXd with_eigenvalues(const MatrixXd& b, const VectorXd& values) {
    return product(MatrixXd(b * values.asDiagonal()), MatrixXd(b.transpose()));
}

MatrixXcd with_eigenvalues(const MatrixXcd& b, const VectorXd& values) {
    return product(MatrixXcd(b * values.asDiagonal()), MatrixXcd(b.adjoint()));
}

}  // namespace btfield::reference
