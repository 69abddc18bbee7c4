#include "host/analysis/marginal_moments.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "host/base/normal_distribution.hpp"
#include "tests/reference/plane_restorer.hpp"

namespace btfield {

using namespace detail;

namespace {

// Integrals over ±9 deviations (beyond: 1e-19) by the trapezoidal rule at h = 0.002: kinks leave h²/12 times
// their jumps and the density, 1e-7 of maps of unit slope.
constexpr double quadrature_step = 0.002;
constexpr double quadrature_error = 1e-6;

template <class Integrand>
double normal_mean(const Integrand& f) {
    double sum = 0.0;
    for (int k = -4500; k <= 4500; ++k) sum += f(k * quadrature_step) * normal_density(k * quadrature_step);
    return sum * quadrature_step;
}

/// E q(y) of y ~ N(m, s²): a sum of hinges, E max(y − t, 0) = s φ(a) + (m − t) Φ(a), a = (m − t)/s.
double mean_of(const std::vector<double>& q, double m, double s) {
    const auto n = static_cast<int>(q.size());
    const double step = 7.0 / (n - 1);
    double sum = q.front(), before = 0.0;
    for (int k = 0; k < n; ++k) {
        const auto at = static_cast<std::size_t>(k);
        const double slope = k + 1 < n ? (q[at + 1] - q[at]) / step : 0.0;
        const double t = -3.5 + k * step, a = (m - t) / s;
        sum += (slope - before) * (s * normal_density(a) + (m - t) * normal_cumulative(a));
        before = slope;
    }
    return sum;
}

struct Shape {
    const char* name;
    Marginal marginal;
};

std::vector<Shape> shapes() {
    std::vector<Shape> result;
    const auto add = [&](const char* name, int knots, auto&& q) {
        Shape shape{name, {}};
        for (int k = 0; k < knots; ++k) shape.marginal.values.push_back(q(-3.5 + 7.0 * k / (knots - 1)));
        result.push_back(std::move(shape));
    };
    add("identity", 24, [](double x) { return x; });
    add("log-normal", 32, [](double x) { return std::exp(0.6 * x); });
    add("uniform", 16, [](double x) { return normal_cumulative(x); });
    add("staircase", 32, [](double x) { return std::round(1.5 * x); });
    add("binary", 24, [](double x) { return x > 0.4 ? 1.0 : 0.0; });
    add("few knots", 4, [](double x) { return x * x * x; });
    return result;
}

TEST(MarginalMoments, HatsFollowQuadrature) {
    for (const int knots : {4, 16, 33})
        for (const double variance : {0.25, 1.0, 1.7}) {
            const HatMoments hats = hat_moments(knots, variance);
            const double deviation = std::sqrt(variance);
            for (std::size_t k = 0; k < hats.mean.size(); ++k) {
                std::vector<double> hat(hats.mean.size()), next(hats.mean.size());
                hat[k] = 1.0;
                const auto h = [&](double z) { return reference::mapped(hat, deviation * z); };
                // Slopes of hats are up to 33/7, jumps twice that, squared in h².
                EXPECT_LE(std::abs(hats.mean[k] - normal_mean(h)), 20 * quadrature_error);
                EXPECT_LE(std::abs(hats.square[k] - normal_mean([&](double z) { return h(z) * h(z); })),
                          40 * quadrature_error);
                if (k + 1 == hats.mean.size()) continue;
                next[k + 1] = 1.0;
                const auto both = [&](double z) { return h(z) * reference::mapped(next, deviation * z); };
                EXPECT_LE(std::abs(hats.product[k] - normal_mean(both)), 40 * quadrature_error);
            }
            double total = 0.0;
            for (const double mean : hats.mean) total += mean;
            EXPECT_LE(std::abs(total - 1.0), 1e-13);
        }
}

TEST(MarginalMoments, MeanAndVarianceFollowQuadrature) {
    for (const Shape& shape : shapes())
        for (const double variance : {0.81, 1.0, 1.2}) {
            SCOPED_TRACE(std::string(shape.name) + ", variance " + std::to_string(variance));
            const std::vector<double>& q = shape.marginal.values;
            const double deviation = std::sqrt(variance);
            const auto f = [&](double z) { return reference::mapped(q, deviation * z); };
            const double mean = normal_mean(f);
            const double second = normal_mean([&](double z) { return (f(z) - mean) * (f(z) - mean); });
            const MappedMoments found =
                mapped_moments(shape.marginal, hat_moments(static_cast<int>(q.size()), variance));
            const double scale = 1.0 + second;
            EXPECT_LE(std::abs(found.mean - mean), 20 * quadrature_error * scale);
            EXPECT_LE(std::abs(found.variance - second), 40 * quadrature_error * scale);
        }
}

TEST(MarginalMoments, CovariancesFollowQuadrature) {
    const std::vector<Shape> all = shapes();
    for (std::size_t i = 0; i < all.size(); ++i)
        for (std::size_t j = 0; j <= i; ++j) {
            const std::vector<Marginal> marginals{all[i].marginal, all[j].marginal};
            const std::vector<double> variances{1.1, 0.9};
            const MappedCovariance covariance(marginals, variances);
            const double si = std::sqrt(variances[0]), sj = std::sqrt(variances[1]);
            const auto deviation = [&](std::size_t k) {
                return std::sqrt(
                    mapped_moments(marginals[k],
                                   hat_moments(static_cast<int>(marginals[k].values.size()), variances[k]))
                        .variance);
            };
            // As promised: 1e-4 of the deviations.
            const double bound = 1e-4 * deviation(0) * deviation(1);
            for (const double rho : {-0.98, -0.7, -0.2, 0.0, 0.1, 0.5, 0.9, 0.99}) {
                SCOPED_TRACE(std::string(all[i].name) + " and " + all[j].name + ", correlation " +
                             std::to_string(rho));
                const double rest = sj * std::sqrt(1.0 - rho * rho);
                const double expected = normal_mean([&](double z) {
                    return (reference::mapped(marginals[0].values, si * z) - covariance.mean(0)) *
                           (mean_of(marginals[1].values, sj * rho * z, rest) - covariance.mean(1));
                });
                EXPECT_LE(std::abs(covariance(0, 1, rho * si * sj) - expected), bound);
                EXPECT_LE(std::abs(covariance(1, 0, rho * si * sj) - expected), bound);
            }
        }
}

TEST(MarginalMoments, SelfCovarianceAtFullCorrelationIsTheVariance) {
    for (const Shape& shape : shapes()) {
        SCOPED_TRACE(shape.name);
        const std::vector<Marginal> marginals{shape.marginal};
        const std::vector<double> variances{1.05};
        const MappedCovariance covariance(marginals, variances);
        const double variance =
            mapped_moments(shape.marginal, hat_moments(static_cast<int>(shape.marginal.values.size()), 1.05))
                .variance;
        EXPECT_LE(std::abs(covariance(0, 0, 1.05) - variance), 1e-12 * variance);
        // Rounding beyond full correlation is full correlation.
        EXPECT_LE(std::abs(covariance(0, 0, 1.05 * (1.0 + 1e-12)) - variance), 1e-12 * variance);
    }
}

TEST(MarginalMoments, IdentityChangesNothing) {
    // Inside ±3.5 of a normal of deviation 0.5 nothing is cut off that float64 sees at 1e-9: E x² beyond 7σ
    // is 5e-11.
    const std::vector<Marginal> marginals{shapes().front().marginal, shapes().front().marginal};
    const std::vector<double> variances{0.25, 0.25};
    const MappedCovariance covariance(marginals, variances);
    for (const double c : {-0.25, -0.1, 0.0, 0.2, 0.25}) EXPECT_LE(std::abs(covariance(0, 1, c) - c), 1e-9);
    const std::vector<double> block{0.25, 0.1, 0.1, 0.25, 0.2, -0.05, 0.02, 0.1};
    const std::vector<double> found = covariance(block);
    ASSERT_EQ(found.size(), block.size());
    for (std::size_t k = 0; k < block.size(); ++k) EXPECT_LE(std::abs(found[k] - block[k]), 1e-9);
}

TEST(MarginalMoments, PlanesWithoutVarianceHaveNone) {
    const std::vector<Marginal> marginals{shapes()[1].marginal, shapes()[2].marginal};
    const std::vector<double> variances{0.0, 1.0};
    const MappedCovariance covariance(marginals, variances);
    EXPECT_EQ(covariance(0, 0, 0.0), 0.0);
    EXPECT_EQ(covariance(0, 1, 0.0), 0.0);
    EXPECT_EQ(covariance.mean(0), quantile(marginals[0], 0.0));
}

}  // namespace
}  // namespace btfield
