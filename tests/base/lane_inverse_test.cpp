#include "host/base/lane_inverse.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <complex>
#include <limits>
#include <random>
#include <vector>

namespace btfield {

using namespace detail;

namespace {

using std::size_t;
constexpr double epsilon = std::numeric_limits<double>::epsilon();

TEST(LaneInverse, InvertsEveryLane) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> entry(-1.0, 1.0);
    for (const int d : {1, 2, 3, 4, 6}) {
        for (const size_t lanes : {size_t{1}, size_t{3}, size_t{16}, size_t{37}}) {
            const auto entries = static_cast<size_t>(d) * static_cast<size_t>(d);
            std::vector<double> matrix(2 * entries * lanes), inverse(matrix.size()), determinant(2 * lanes);
            for (double& value : matrix) value = entry(random);
            invert_lanes(d, lanes, matrix.data(), inverse.data(), determinant.data());
            for (size_t n = 0; n < lanes; ++n) {
                Eigen::MatrixXcd a(d, d), b(d, d);
                for (int e = 0; e < d * d; ++e) {
                    const size_t place = 2 * static_cast<size_t>(e) * lanes + n;
                    a(e / d, e % d) = {matrix[place], matrix[place + lanes]};
                    b(e / d, e % d) = {inverse[place], inverse[place + lanes]};
                }
                // The adjugate's products have d factors of at most √2, cancelled down to the determinant.
                const std::complex<double> det = a.determinant();
                const double rounding = 100.0 * d * std::pow(std::sqrt(2.0) * d, d) * epsilon;
                EXPECT_LE((a * b - Eigen::MatrixXcd::Identity(d, d)).norm(),
                          rounding * (1.0 + a.norm() / std::abs(det)))
                    << d << " " << n;
                EXPECT_LE(std::abs(std::complex<double>(determinant[n], determinant[lanes + n]) - det),
                          rounding)
                    << d << " " << n;
            }
        }
    }
}

TEST(LaneInverse, LogarithmsOfProductsAreSumsOfLogarithms) {
    const std::vector<double> values = {1e-300, 2.0, 1e-200, 1e250, 3.0,  1e160, 1e-160, 1e160, 0.5,
                                        0.25,   7.0, 1e-12,  1e300, 1e10, 1.0,   0.125,  11.0};
    for (size_t count = 0; count <= values.size(); ++count) {
        double sum = 0.0, size = 0.0;
        for (size_t n = 0; n < count; ++n) {
            sum += std::log(values[n]);
            size += std::abs(std::log(values[n])) + 1.0;
        }
        EXPECT_NEAR(sum_of_logarithms(values.data(), count), sum, 20.0 * epsilon * size) << count;
    }
    const std::vector<double> zero = {1.0, 0.0, 1.0, 1.0};
    EXPECT_EQ(sum_of_logarithms(zero.data(), 4), -std::numeric_limits<double>::infinity());
    const std::vector<double> missing = {1.0, std::numeric_limits<double>::quiet_NaN(), 1.0, 1.0};
    EXPECT_TRUE(std::isnan(sum_of_logarithms(missing.data(), 4)));
}

}  // namespace
}  // namespace btfield
