#include "host/analysis/working_basis.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>

namespace btfield::detail {
namespace {

using Eigen::MatrixXd;

constexpr double epsilon = std::numeric_limits<double>::epsilon();

/// Deviations 2, 0.5 and 30, correlations 0.9, −0.3 and 0.1.
MatrixXd covariance() {
    MatrixXd c(3, 3);
    c << 4.0, 0.9, -18.0, 0.9, 0.25, 1.5, -18.0, 1.5, 900.0;
    return c;
}

double largest(const MatrixXd& m) {
    return m.allFinite() ? m.cwiseAbs().maxCoeff() : std::numeric_limits<double>::infinity();
}

/// Bound for rounding of products of a few matrices: they amplify it by the condition of the basis at most.
double rounding(const WorkingBasis& basis) {
    return 64.0 * epsilon * basis.forward.norm() * basis.inverse.norm();
}

TEST(WorkingBasis, ThereAndBackIsTheIdentity) {
    for (const Turn turn : {Turn::none, Turn::principal, Turn::nearest, Turn::rotation}) {
        const WorkingBasis basis = working_basis(covariance(), turn);
        EXPECT_LE(largest(basis.forward * basis.inverse - MatrixXd::Identity(3, 3)), rounding(basis));
    }
}

TEST(WorkingBasis, HasTheCovarianceThatItPromises) {
    const auto turned = [](const WorkingBasis& basis) -> MatrixXd {
        return basis.forward * covariance() * basis.forward.transpose();
    };
    for (const Turn turn : {Turn::principal, Turn::nearest}) {
        const WorkingBasis basis = working_basis(covariance(), turn);
        EXPECT_LE(largest(turned(basis) - MatrixXd::Identity(3, 3)), rounding(basis));
    }
    const WorkingBasis scaled = working_basis(covariance(), Turn::none);
    EXPECT_LE(largest(turned(scaled).diagonal() - Eigen::VectorXd::Ones(3)), rounding(scaled));
    EXPECT_EQ(largest(scaled.forward - MatrixXd(scaled.forward.diagonal().asDiagonal())), 0.0);
    const WorkingBasis rotated = working_basis(covariance(), Turn::rotation);
    const MatrixXd c = turned(rotated);
    EXPECT_LE(largest(c - MatrixXd(c.diagonal().asDiagonal())), 900.0 * rounding(rotated));
    EXPECT_LE(largest(rotated.forward * rotated.forward.transpose() - MatrixXd::Identity(3, 3)),
              rounding(rotated));
}

/// The symmetric root of the correlation is positive definite: no plane changes its sign or its place.
TEST(WorkingBasis, NearestIsASymmetricRoot) {
    const WorkingBasis basis = working_basis(covariance(), Turn::nearest);
    const MatrixXd root = basis.forward * MatrixXd(covariance().diagonal().cwiseSqrt().asDiagonal());
    EXPECT_LE(largest(root - root.transpose()), rounding(basis));
    EXPECT_GT(root.determinant(), 0.0);
    EXPECT_GT(root(0, 0), 0.0);
}

/// Two planes that are the same have correlation eigenvalues 0 and 2.
TEST(WorkingBasis, FloorBoundsPlanesThatRepeatEachOther) {
    const MatrixXd same = MatrixXd::Constant(2, 2, 9.0);
    const Eigen::VectorXd values = correlation_eigenvalues(same);
    EXPECT_NEAR(values[0], 0.0, 8.0 * epsilon);
    EXPECT_NEAR(values[1], 2.0, 8.0 * epsilon);
    const auto weakest = [&](EigenvalueFloor floor) {
        // The row of what the planes differ by: 1/(3 √least) along (1, −1)/√2.
        return working_basis(same, Turn::principal, floor).forward.row(0).norm();
    };
    EXPECT_NEAR(weakest({.absolute = 1e-6}), 1.0 / (3.0 * std::sqrt(1e-6)), 1e-9);
    EXPECT_NEAR(weakest({.relative = 1e-6}), 1.0 / (3.0 * std::sqrt(2e-6)), 1e-9);
    EXPECT_NEAR(weakest({.absolute = 1e-4, .relative = 1e-6}), 1.0 / (3.0 * std::sqrt(1e-4)), 1e-9);
    for (const Turn turn : {Turn::principal, Turn::nearest}) {
        const WorkingBasis basis = working_basis(same, turn, {.relative = 1e-8});
        EXPECT_LE(largest(basis.forward * basis.inverse - MatrixXd::Identity(2, 2)), rounding(basis));
    }
}

}  // namespace
}  // namespace btfield::detail
