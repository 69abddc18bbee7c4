#include "host/spectrum/spectral_points.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "host/spectrum/local_lambda.hpp"

namespace btfield {

using namespace detail;

namespace {

using Eigen::MatrixXcd;
using std::size_t;

TEST(SpectralPoints, AreWhatSingleFrequenciesGive) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (const int d : {1, 2, 3, 4, 6}) {
        LinearField field;
        field.planes = d;
        field.offsets = {{-2, 1}, {-1, 0}, {0, -3}, {0, 2}, {1, -1}, {2, 2}};
        const auto block = static_cast<size_t>(d) * static_cast<size_t>(d);
        for (size_t k = 0; k < field.offsets.size() * block; ++k)
            field.coefficients.push_back(0.1 * unit(random));
        for (size_t e = 0; e < block; ++e)
            field.noise_covariance.push_back(e % static_cast<size_t>(d + 1) == 0 ? 1.0 : 0.1);
        constexpr int lanes = 19;
        std::vector<double> rows, columns;
        for (int n = 0; n < lanes; ++n) {
            rows.push_back(4.0 * unit(random));
            columns.push_back(4.0 * unit(random));
        }
        const SpectralForm form(field);
        SpectralPoints points(form, lanes);
        const LocalLambda<Eigen::Dynamic> local(field);
        const MatrixXcd noise = noise_matrix(field).cast<std::complex<double>>();
        // Twice: what the first evaluation leaves must not show in the second.
        for (int repeat = 0; repeat < 2; ++repeat) points.evaluate(rows, columns);
        points.evaluate_density();
        for (int n = 0; n < lanes; ++n) {
            const auto place = static_cast<size_t>(n);
            MatrixXcd value, by_row, by_column;
            local.derivatives(rows[place], columns[place], value, by_row, by_column);
            const MatrixXcd inverse = value.inverse();
            // Sums of some d · 6 terms, amplified by the inverse, twice for the density.
            const double rounding = 100.0 * d * 6 * std::numeric_limits<double>::epsilon() *
                                    (1.0 + inverse.norm()) * (1.0 + inverse.norm());
            const double scale = 1.0 + by_row.norm() + by_column.norm() + value.norm();
            EXPECT_NEAR(points.inverse_norm(n), inverse.norm(), rounding * scale);
            EXPECT_NEAR(points.by_row(n), (inverse * by_row).norm(), rounding * scale);
            EXPECT_NEAR(points.by_column(n), (inverse * by_column).norm(), rounding * scale);
            EXPECT_LE(std::abs(points.determinant(n) - value.determinant()),
                      rounding * (1.0 + std::abs(value.determinant())));
            const MatrixXcd density = inverse * noise * inverse.adjoint();
            for (int i = 0; i < d; ++i) {
                for (int j = i; j < d; ++j) {
                    EXPECT_NEAR(points.density(i, j)[n], density(i, j).real(),
                                rounding * scale * (1.0 + noise.norm()));
                }
            }
        }
    }
}

}  // namespace
}  // namespace btfield
