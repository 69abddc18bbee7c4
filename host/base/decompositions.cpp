#include "host/base/decompositions.hpp"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <limits>

namespace btfield::detail {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd least_norm_solution(const MatrixXd& a, const VectorXd& b, std::optional<double> threshold) {
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver;
    if (threshold) solver.setThreshold(*threshold);
    return solver.compute(a).solve(b);
}

MatrixXd upper_factor(const MatrixXd& a) {
    return Eigen::HouseholderQR<MatrixXd>(a).matrixQR().triangularView<Eigen::Upper>();
}

RowMajorMatrix orthonormal_columns(const RowMajorMatrix& a) {
    const Eigen::HouseholderQR<MatrixXd> solver{MatrixXd(a)};
    MatrixXd q = MatrixXd::Identity(a.rows(), a.cols());
    q.applyOnTheLeft(solver.householderQ());
    return q;
}

double spectral_radius(const MatrixXcd& a) {
    if (!a.allFinite()) return std::numeric_limits<double>::infinity();
    const Eigen::ComplexSchur<MatrixXcd> schur(a, false);
    if (schur.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
    return schur.matrixT().diagonal().cwiseAbs().maxCoeff();
}

double smallest_singular_value(const MatrixXcd& a) {
    return Eigen::JacobiSVD<MatrixXcd, Eigen::NoQRPreconditioner>(a).singularValues().minCoeff();
}

HermitianRoot hermitian_root(const MatrixXcd& a) {
    const Eigen::SelfAdjointEigenSolver<MatrixXcd> solver(a);
    HermitianRoot root{solver.eigenvalues().minCoeff(), {}};
    if (root.lowest > 0.0) root.inverse = solver.operatorInverseSqrt();
    return root;
}

}  // namespace btfield::detail
