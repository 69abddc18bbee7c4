#include "host/spectrum/spectral_density.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

#include "btfield/error.hpp"
#include "tests/reference/algebra.hpp"
#include "tests/reference/fields.hpp"

namespace btfield {

using namespace detail;

namespace {

struct Case {
    int planes;
    Size torus;
};

class SpectralDensities : public testing::TestWithParam<Case> {};

TEST_P(SpectralDensities, CovariancesAreThoseOfTheInvertedRecursion) {
    const auto [d, torus] = GetParam();
    const LinearField field = reference::random_field(d, {{-1, -1}, {-1, 2}, {0, -1}, {0, 1}, {2, 0}}, 0.9,
                                                      static_cast<unsigned>(d));
    const Eigen::MatrixXd covariance = reference::field_covariance(field, torus);
    const Offset box{3, 4};
    const LagCovariance found = model_covariance(field, torus, box);
    EXPECT_EQ(found.size(), torus);
    for (int i = 0; i < d; ++i) {
        for (int j = 0; j < d; ++j) {
            for (int row = -box.row; row <= box.row; ++row) {
                for (int column = -box.column; column <= box.column; ++column) {
                    // Both are some hundred products of numbers of order one, with conditions below 1.9 /
                    // 0.1.
                    EXPECT_NEAR(found(i, j, {row, column}),
                                reference::lag_covariance(covariance, torus, i, j, {row, column}), 1e-11)
                        << i << j << ' ' << row << ' ' << column;
                }
            }
        }
    }
}

TEST_P(SpectralDensities, MeansAreTheTraceAndDeterminantOfTheRecursion) {
    const auto [d, torus] = GetParam();
    const LinearField field = reference::random_field(d, {{-1, 0}, {0, 1}, {1, 1}}, 0.9, 17);
    const Eigen::MatrixXd covariance = reference::field_covariance(field, torus);
    const SpectralMeans means = spectral_means(field, torus);
    for (int i = 0; i < d; ++i) {
        for (int j = 0; j < d; ++j) {
            EXPECT_NEAR(means.covariance(i, j), reference::lag_covariance(covariance, torus, i, j, {}),
                        1e-11);
        }
    }
    // det Σ_Y = det Σ_ε / det Ψ², and ln |det Ψ| is the sum of ln |det Λ_t|.
    const double pixels = static_cast<double>(area(torus));
    const double log_noise = std::log(noise_matrix(field).determinant());
    const double log_covariance = 2.0 * reference::lower_root(covariance).diagonal().array().log().sum();
    EXPECT_NEAR(means.log_determinant, 0.5 * (log_noise - log_covariance / pixels), 1e-11);
}

INSTANTIATE_TEST_SUITE_P(Tori, SpectralDensities,
                         testing::Values(Case{1, {1, 1}}, Case{1, {7, 9}}, Case{2, {6, 5}}, Case{3, {5, 8}},
                                         Case{4, {4, 5}}, Case{5, {3, 4}}, Case{1, {1, 12}},
                                         Case{2, {9, 1}}));

TEST(SpectralDensity, RefusesEmptyTori) {
    const LinearField field = reference::scalar_field({{-1, 0}}, {0.5});
    try {
        (void)model_covariance(field, {0, 4}, {1, 1});
        ADD_FAILURE() << "accepted";
    } catch (const InputError& error) {
        EXPECT_EQ(error.found(), "4 x 0 has no pixel");  // width first
    }
    EXPECT_THROW((void)model_covariance(field, {4, 4}, {-1, 1}), InputError);
}

}  // namespace
}  // namespace btfield
