#include "host/analysis/working_basis.hpp"

#include <algorithm>

namespace btfield::detail {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Solver = Eigen::SelfAdjointEigenSolver<MatrixXd>;

MatrixXd correlation_of(const MatrixXd& covariance) {
    const VectorXd scale = covariance.diagonal().cwiseSqrt().cwiseInverse();
    return scale.asDiagonal() * covariance * scale.asDiagonal();
}

}  // namespace

WorkingBasis working_basis(const MatrixXd& covariance, Turn turn, EigenvalueFloor floor) {
    if (turn == Turn::rotation) {
        const Solver solver(covariance);
        return {solver.eigenvectors().transpose(), solver.eigenvectors()};
    }
    const VectorXd deviation = covariance.diagonal().cwiseSqrt(), scale = deviation.cwiseInverse();
    if (turn == Turn::none) return {MatrixXd(scale.asDiagonal()), MatrixXd(deviation.asDiagonal())};
    const Solver solver(correlation_of(covariance));
    const MatrixXd& u = solver.eigenvectors();
    const double least = std::max(floor.absolute, floor.relative * solver.eigenvalues().maxCoeff());
    const VectorXd root = solver.eigenvalues().cwiseMax(least).cwiseSqrt();
    if (turn == Turn::nearest) {
        return {u * root.cwiseInverse().asDiagonal() * u.transpose() * scale.asDiagonal(),
                deviation.asDiagonal() * u * root.asDiagonal() * u.transpose()};
    }
    return {root.cwiseInverse().asDiagonal() * u.transpose() * scale.asDiagonal(),
            deviation.asDiagonal() * u * root.asDiagonal()};
}

VectorXd correlation_eigenvalues(const MatrixXd& covariance) {
    return Solver(correlation_of(covariance), Eigen::EigenvaluesOnly).eigenvalues();
}

}  // namespace btfield::detail
