#include "host/fit/level_gains.hpp"
#include "host/analysis/expansion.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <bit>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "btfield/pyramid.hpp"
#include "host/base/non_negative.hpp"
#include "host/spectrum/spectral_density.hpp"
#include "tests/reference/algebra.hpp"
#include "tests/reference/fields.hpp"
#include "tests/reference/lag_covariance.hpp"

namespace btfield {

using namespace detail;

namespace {

/// One expansion on the torus as a matrix, one axis: z(r) = Σ_q n w(r − n q) y(q).
Eigen::MatrixXd expansion(int coarse, int factor) {
    const std::vector<double> w = pyramid_kernel(factor);
    const int radius = static_cast<int>(w.size()) / 2, fine = coarse * factor;
    Eigen::MatrixXd e = Eigen::MatrixXd::Zero(fine, coarse);
    for (int q = 0; q < coarse; ++q) {
        for (int t = -radius; t <= radius; ++t) {
            e(reference::wrapped(factor * q + t, fine), q) +=
                factor * w[static_cast<std::size_t>(t + radius)];
        }
    }
    return e;
}

Eigen::MatrixXd expansions(int coarse, int factor, int depth) {
    Eigen::MatrixXd e = Eigen::MatrixXd::Identity(coarse, coarse);
    for (int k = 0; k < depth; ++k) e = reference::product(expansion(static_cast<int>(e.rows()), factor), e);
    return e;
}

TEST(LevelGains, ExpansionKeepsConstants) {
    for (const int factor : {2, 3, 5}) {
        for (const int depth : {0, 1, 2, 3}) {
            const std::vector<double> e = composed_expand_kernel(factor, depth);
            const int step = static_cast<int>(std::lround(std::pow(factor, depth)));
            ASSERT_EQ(e.size() % 2, 1U);
            for (int phase = 0; phase < step; ++phase) {
                double sum = 0.0;
                for (std::size_t k = static_cast<std::size_t>(phase); k < e.size();
                     k += static_cast<std::size_t>(step)) {
                    sum += e[k];
                }
                EXPECT_NEAR(sum, 1.0, 1e-13) << factor << ' ' << depth << ' ' << phase;
            }
        }
    }
}

struct Case {
    int factor, depth;
    Size level;
};

class ExpandedCovariances : public testing::TestWithParam<Case> {};

TEST_P(ExpandedCovariances, EqualThoseOfTheExpandedPixels) {
    const auto [factor, depth, size] = GetParam();
    const LinearField field =
        reference::random_field(2, neighbourhood(2, NeighbourhoodKind::symmetric), 0.9, 3);
    const Eigen::MatrixXd rows = expansions(size.height, factor, depth),
                          columns = expansions(size.width, factor, depth);
    const Size full{static_cast<int>(rows.rows()), static_cast<int>(columns.rows())};
    const Eigen::MatrixXd covariance = reference::field_covariance(field, size);
    const auto pixels = static_cast<Eigen::Index>(area(size));

    const std::vector<Offset> lags = {{0, 0}, {0, 1}, {1, 0}, {1, 1},  {1, -1},
                                      {2, 2}, {3, 0}, {0, 5}, {4, -4}, {-2, 3}};
    const LagCovariance level = model_covariance(field, size, expansion_box(factor, depth, lags));
    const std::vector<double> found = expanded_covariance(level, factor, depth, lags);
    std::size_t next = 0;
    for (const Offset s : lags) {
        for (int i = 0; i < 2; ++i) {
            for (int j = 0; j < 2; ++j) {
                // mean_r e_rᵀ C_ij e_{r+s}, e_r the Kronecker product of a row of each expansion.
                const Eigen::MatrixXd block = covariance.block(i * pixels, j * pixels, pixels, pixels);
                double sum = 0.0;
                for (int r1 = 0; r1 < full.height; ++r1) {
                    for (int r2 = 0; r2 < full.width; ++r2) {
                        Eigen::VectorXd here(pixels), there(pixels);
                        for (int q = 0; q < pixels; ++q) {
                            const int q1 = q / size.width, q2 = q % size.width;
                            here[q] = rows(r1, q1) * columns(r2, q2);
                            there[q] = rows(reference::wrapped(r1 + s.row, full.height), q1) *
                                       columns(reference::wrapped(r2 + s.column, full.width), q2);
                        }
                        sum += here.dot(reference::product(block, there));
                    }
                }
                // Sums of some thousand products of order one in float64.
                EXPECT_NEAR(found[next++], sum / static_cast<double>(area(full)), 1e-11)
                    << s.row << ' ' << s.column << ' ' << i << j;
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(LevelGains, ExpandedCovariances,
                         testing::Values(Case{2, 0, {5, 6}}, Case{2, 1, {4, 5}}, Case{2, 2, {3, 4}},
                                         Case{3, 1, {3, 4}}, Case{4, 1, {3, 3}}, Case{2, 3, {2, 2}}));

/// Smallest objective over all sets of free unknowns whose solution is not negative.
Eigen::VectorXd enumerated(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
    Eigen::VectorXd best = Eigen::VectorXd::Zero(a.cols());
    double lowest = b.squaredNorm();
    for (int set = 1; set < 1 << a.cols(); ++set) {
        Eigen::MatrixXd columns(a.rows(), std::popcount(static_cast<unsigned>(set)));
        std::vector<int> free;
        for (int k = 0; k < a.cols(); ++k) {
            if ((set >> k & 1) == 0) continue;
            columns.col(static_cast<Eigen::Index>(free.size())) = a.col(k);
            free.push_back(k);
        }
        const Eigen::VectorXd solution = reference::least_squares(columns, b);
        Eigen::VectorXd x = Eigen::VectorXd::Zero(a.cols());
        for (std::size_t n = 0; n < free.size(); ++n) x[free[n]] = solution[static_cast<Eigen::Index>(n)];
        if (x.minCoeff() < 0.0) continue;
        const double value = (reference::product(a, x) - b).squaredNorm();
        if (value < lowest) {
            lowest = value;
            best = x;
        }
    }
    return best;
}

TEST(LevelGains, NonNegativeLeastSquaresFindsTheBestSet) {
    std::mt19937 engine(11);
    std::normal_distribution<double> normal;
    int bounded = 0;
    for (int trial = 0; trial < 200; ++trial) {
        const int unknowns = 1 + trial % 5;
        Eigen::MatrixXd a(8, unknowns);
        Eigen::VectorXd b(8);
        for (double& value : a.reshaped()) value = normal(engine);
        for (double& value : b.reshaped()) value = normal(engine);
        const Eigen::VectorXd x = non_negative_least_squares(a, b), expected = enumerated(a, b);
        ASSERT_GE(x.minCoeff(), 0.0);
        for (int k = 0; k < unknowns; ++k) EXPECT_NEAR(x[k], expected[k], 1e-9) << trial;
        if (x.minCoeff() == 0.0) ++bounded;
    }
    EXPECT_GT(bounded, 50);  // otherwise the constraint was not tried
    EXPECT_EQ(non_negative_least_squares(Eigen::MatrixXd::Ones(3, 2), -Eigen::VectorXd::Ones(3)).norm(), 0.0);
}

TEST(LevelGains, KnownGainsComeBack) {
    const std::vector<Offset> lags = probe_lags({64, 64});
    const std::vector<double> expected = {0.5, 1.7, 0.0, 1.2};
    std::vector<std::vector<double>> levels;
    std::vector<double> data(lags.size() * 4);
    for (std::size_t k = 0; k < expected.size(); ++k) {
        const LinearField field = reference::random_field(2, neighbourhood(2, NeighbourhoodKind::causal), 0.9,
                                                          static_cast<unsigned>(k));
        const int depth = static_cast<int>(k);
        const LagCovariance level =
            model_covariance(field, {64 >> k, 64 >> k}, expansion_box(2, depth, lags));
        levels.push_back(expanded_covariance(level, 2, depth, lags));
        for (std::size_t n = 0; n < data.size(); ++n) data[n] += expected[k] * expected[k] * levels[k][n];
    }
    const std::vector<double> gains = match_gains(levels, data, 2);
    ASSERT_EQ(gains.size(), expected.size());
    // The squares are exact to rounding, about 1e-14; a gain of zero is the root of that.
    for (std::size_t k = 0; k < gains.size(); ++k) EXPECT_NEAR(gains[k], expected[k], 1e-6) << k;
}

}  // namespace
}  // namespace btfield
