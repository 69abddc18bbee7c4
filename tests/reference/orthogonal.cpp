#include <Eigen/QR>
#include <Eigen/SVD>

#include "tests/reference/algebra.hpp"

namespace btfield::reference {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// a = Q R by reflections, of its first `steps` columns: R comes into their upper triangle, the reflections'
/// vectors below it, Q* times the other columns into these. Returns the reflections' factors.
template <class Matrix>
auto reflect(Matrix& a, Index steps) {
    using Vector = Eigen::Matrix<typename Matrix::Scalar, Eigen::Dynamic, 1>;
    Vector factors(steps), workspace(a.cols());
    for (Index k = 0; k < steps; ++k) {
        const Index rows = a.rows() - k, columns = a.cols() - k - 1;
        double diagonal = 0.0;
        a.col(k).tail(rows).makeHouseholderInPlace(factors[k], diagonal);
        a(k, k) = diagonal;
        a.bottomRightCorner(rows, columns)
            .applyHouseholderOnTheLeft(a.col(k).tail(rows - 1), factors[k], workspace.data());
    }
    return factors;
}

template <class Matrix>
Matrix orthogonal_part(Matrix a) {
    const Index n = a.rows();
    const auto factors = reflect(a, n);
    Matrix q = Matrix::Identity(n, n), workspace(n, 1);
    for (Index k = n - 1; k >= 0; --k)
        q.bottomRightCorner(n - k, n - k)
            .applyHouseholderOnTheLeft(a.col(k).tail(n - k - 1), Eigen::numext::conj(factors[k]),
                                       workspace.data());
    return q;
}

}  // namespace

VectorXd least_squares(const MatrixXd& a, const VectorXd& b) {
    const Index n = a.cols();
    MatrixXd both(a.rows(), n + 1);
    both << a, b;
    reflect(both, n);
    return both.topLeftCorner(n, n).triangularView<Eigen::Upper>().solve(both.col(n).head(n));
}

VectorXd singular_values(const MatrixXcd& a) {
    return Eigen::JacobiSVD<MatrixXcd, Eigen::NoQRPreconditioner>(a).singularValues();
}

MatrixXd orthogonal_factor(const MatrixXd& a) {
    return orthogonal_part(a);
}

MatrixXcd unitary_factor(const MatrixXcd& a) {
    return orthogonal_part(a);
}

}  // namespace btfield::reference
