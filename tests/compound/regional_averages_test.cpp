// host/compound/regional_averages.cpp.

#include "host/compound/regional_averages.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "btfield/error.hpp"
#include "host/analysis/lag_matrices.hpp"
#include "host/base/eigen.hpp"

namespace btfield {

using namespace detail;

namespace {

using Eigen::MatrixXd;
using std::size_t;

using Kernel = std::map<Offset, MatrixXd>;

/// A_{−s} = A_sᵀ with a centre that outweighs the rest: its transfer function is Hermitian and positive.
Kernel positive_kernel(int planes, const std::vector<Offset>& offsets) {
    std::mt19937 generator(static_cast<unsigned>(planes));
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    Kernel kernel;
    double sum = 0.0;
    for (const Offset s : offsets) {
        if (kernel.contains(-s) || s == Offset{}) continue;
        MatrixXd a(planes, planes);
        for (double& entry : a.reshaped()) entry = uniform(generator);
        sum += 2.0 * a.norm();
        kernel[s] = a;
        kernel[-s] = a.transpose();
    }
    kernel[{}] = (sum + 0.5) * MatrixXd::Identity(planes, planes);
    return kernel;
}

/// C(τ) = Σ_s A_s A_{s+τ}ᵀ of white noise of variance 1.
LagCovariance covariance_of(const Kernel& kernel, Offset box) {
    const int d = static_cast<int>(kernel.begin()->second.rows());
    LagCovariance result(d, {64, 64}, box);
    for (int row = 0; row <= box.row; ++row)
        for (int column = row == 0 ? 0 : -box.column; column <= box.column; ++column) {
            MatrixXd sum = MatrixXd::Zero(d, d);
            for (const auto& [s, a] : kernel)
                if (const auto other = kernel.find({s.row + row, s.column + column}); other != kernel.end())
                    sum += a * other->second.transpose();
            for (int i = 0; i < d; ++i)
                for (int j = 0; j < d; ++j) result.set(i, j, {row, column}, sum(i, j));
        }
    return result;
}

Support symmetric(int order) {
    return {NeighbourhoodKind::symmetric, neighbourhood(order, NeighbourhoodKind::symmetric)};
}

MatrixXd grown_covariance(const MaModel& model) {
    const Eigen::Index d = model.planes;
    MatrixXd sum = MatrixXd::Zero(d, d);
    for (size_t s = 0; s < model.offsets.size(); ++s) {
        const Eigen::Map<const RowMajorMatrix> a(
            model.coefficients.data() + static_cast<std::ptrdiff_t>(s) * d * d, d, d);
        sum += a * a.transpose();
    }
    return sum;
}

TEST(RegionalAverages, PositiveKernelsAreFound) {
    for (const int planes : {1, 2, 4})
        for (const int order : {1, 3, 5}) {
            SCOPED_TRACE("d = " + std::to_string(planes) + ", order " + std::to_string(order));
            const Support support = symmetric(order);
            const Kernel kernel = positive_kernel(planes, support.offsets);
            const MaModel found =
                averages_of_covariances(covariance_of(kernel, difference_box(support.offsets)), support);
            ASSERT_EQ(found.offsets.size(), support.offsets.size() + 1);
            const MatrixXd identity = MatrixXd::Identity(planes, planes);
            EXPECT_TRUE(std::ranges::equal(found.noise_covariance, identity.reshaped()));
            const double most = kernel.at({}).norm();
            size_t at = 0;
            for (const Offset s : found.offsets)
                for (int i = 0; i < planes; ++i)
                    for (int j = 0; j < planes; ++j)
                        EXPECT_NEAR(found.coefficients[at++], kernel.at(s)(i, j), 1e-12 * most)
                            << s.row << ", " << s.column << ": " << i << ", " << j;
        }
}

TEST(RegionalAverages, CovariancesOfNoFieldKeepTheirVariances) {
    // Those of neighbours are larger than that of a pixel with itself.
    LagCovariance statistic(2, {64, 64}, {4, 4});
    statistic.set(0, 0, {}, 2.0);
    statistic.set(0, 1, {}, 0.5);
    statistic.set(1, 0, {}, 0.5);
    statistic.set(1, 1, {}, 3.0);
    for (const Offset s : {Offset{0, 1}, Offset{1, 0}, Offset{2, -1}})
        for (int p = 0; p < 2; ++p) statistic.set(p, p, s, -3.5);
    const MaModel found = averages_of_covariances(statistic, symmetric(3));
    EXPECT_TRUE(grown_covariance(found).isApprox(lag_zero(statistic), 1e-10));
}

TEST(RegionalAverages, PlanesWithoutVarianceAreRefused) {
    LagCovariance statistic(2, {64, 64}, {4, 4});
    statistic.set(0, 0, {}, 1.0);
    EXPECT_THROW(static_cast<void>(averages_of_covariances(statistic, symmetric(3))), InputError);
}

}  // namespace
}  // namespace btfield
