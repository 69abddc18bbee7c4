#include "host/base/dense.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <limits>

namespace btfield {

using namespace detail;

namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

TEST(Dense, ProductsOfAnyShapeAreAdded) {
    for (const Eigen::Index rows : {1, 5, 6, 8, 19}) {
        for (const Eigen::Index columns : {1, 7, 8, 23}) {
            for (const Eigen::Index depth : {1, 2, 33}) {
                const RowMajorMatrix a = RowMajorMatrix::Random(rows, depth),
                                     b = RowMajorMatrix::Random(depth, columns);
                RowMajorMatrix c = RowMajorMatrix::Random(rows + 2, columns + 3);
                const RowMajorMatrix before = c;
                add_product(a, b, c.block(1, 2, rows, columns));
                RowMajorMatrix expected = before;
                expected.block(1, 2, rows, columns) += a * b;
                // Entries are at most 1: each sum of depth + 1 terms rounds as often.
                const auto terms = static_cast<double>(depth + 1);
                EXPECT_LE((c - expected).cwiseAbs().maxCoeff(), 2.0 * terms * terms * epsilon)
                    << rows << " " << columns << " " << depth;
            }
        }
    }
}

TEST(Dense, CholeskySolvesAsEigenDoes) {
    for (const Eigen::Index n : {1, 2, 31, 32, 33, 100}) {
        const Eigen::MatrixXd root = Eigen::MatrixXd::Random(n, 2 * n);
        Eigen::MatrixXd h = root * root.transpose();
        const Eigen::VectorXd b = Eigen::VectorXd::Random(n);
        const Eigen::VectorXd expected = h.llt().solve(b);
        h.triangularView<Eigen::StrictlyUpper>().setConstant(std::numeric_limits<double>::quiet_NaN());
        const Cholesky factor(h);
        ASSERT_TRUE(factor.positive()) << n;
        // Residual of a backward stable solution: n ‖H‖ ‖x‖ roundings.
        const Eigen::VectorXd x = factor.solve(b);
        const double scale = root.squaredNorm() * x.norm();
        EXPECT_LE((root * (root.transpose() * x) - b).norm(),
                  10.0 * static_cast<double>(n + 1) * epsilon * (scale + b.norm()))
            << n;
        EXPECT_LE((root * (root.transpose() * (x - expected))).norm(),
                  20.0 * static_cast<double>(n + 1) * epsilon * (scale + b.norm()))
            << n;
    }
}

TEST(Dense, CholeskyTellsIndefiniteMatricesApart) {
    for (const Eigen::Index at : {0, 10, 40}) {
        Eigen::MatrixXd h = Eigen::MatrixXd::Identity(50, 50);
        h(at, at) = -1.0;
        EXPECT_FALSE(Cholesky(h).positive()) << at;
        h(at, at) = std::numeric_limits<double>::quiet_NaN();
        EXPECT_FALSE(Cholesky(h).positive()) << at;
    }
}

}  // namespace
}  // namespace btfield
