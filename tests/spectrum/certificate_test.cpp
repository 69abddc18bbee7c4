#include "btfield/certificate.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <complex>
#include <numbers>

#include "btfield/error.hpp"
#include "btfield/models.hpp"
#include "host/spectrum/spectral_density.hpp"
#include "tests/reference/fields.hpp"

namespace btfield {

using namespace detail;

namespace {

Certificate certified(const LinearField& field, const LagCovariance& data) {
    return certify(SarModel{field}, data);
}

using reference::scalar_field;
constexpr double pi = std::numbers::pi;

/// Data of uncorrelated planes with this variance.
LagCovariance data(int planes, double variance) {
    LagCovariance statistic(planes, {64, 64}, {0, 0});
    for (int i = 0; i < planes; ++i) statistic.set(i, i, {}, variance);
    return statistic;
}

/// y = a y(−1, 0) + b y(0, −1) − ab y(−1, −1) + e: Λ factors, the variance is 1/((1 − a²)(1 − b²)).
LinearField separable(double a, double b) {
    return scalar_field({{-1, -1}, {-1, 0}, {0, -1}}, {-a * b, a, b});
}

/// A field of one plane for each of the given ones, seen in another basis of planes.
LinearField mixed(const std::vector<LinearField>& parts) {
    const int d = static_cast<int>(parts.size());
    LinearField field;
    field.planes = d;
    for (int i = 0; i < d; ++i) {
        const LinearField& part = parts[static_cast<std::size_t>(i)];
        for (std::size_t s = 0; s < part.offsets.size(); ++s) {
            field.offsets.push_back(part.offsets[s]);
            for (int row = 0; row < d; ++row) {
                for (int column = 0; column < d; ++column) {
                    field.coefficients.push_back(row == i && column == i ? part.coefficients[s] : 0.0);
                }
            }
        }
    }
    for (int e = 0; e < d * d; ++e) field.noise_covariance.push_back(e % (d + 1) == 0 ? 1.0 : 0.0);
    Eigen::MatrixXd basis = Eigen::MatrixXd::Identity(d, d);
    for (int i = 0; i < d; ++i) basis(i, (i + 1) % d) += 0.4;
    return change_basis(field, basis, basis.inverse());
}

TEST(Certificate, SeparableFieldHasItsClosedForms) {
    for (const auto& [a, b] : {std::pair{0.5, 0.3}, {0.9, -0.7}, {-0.8, -0.8}}) {
        const double variance = 1.0 / ((1.0 - a * a) * (1.0 - b * b));
        const Certificate certificate = certified(separable(a, b), data(1, 2.0 * variance));
        EXPECT_TRUE(certificate.valid);
        EXPECT_EQ(certificate.zeros, 0);
        // Sums over n points of a rational spectrum err like the pole's radius to the n, 0.9^128 = 1.4e-6.
        EXPECT_NEAR(certificate.variance_ratio.at(0), 0.5, 1e-5);
        // The minimum is quadratic: the last step of the search, 1e-7, leaves nothing of it.
        EXPECT_NEAR(certificate.min_singular, (1.0 - std::abs(a)) * (1.0 - std::abs(b)), 1e-6);
    }
}

TEST(Certificate, NarrowPeaksAreIntegrated) {
    // At a = 0.999 the peak is 0.002 wide, a 25th of the grid's spacing: the grid alone gives 25 times too
    // much or, with the peak between nodes, nearly nothing.
    for (const double a : {0.99, 0.999, -0.999}) {
        const double variance = 1.0 / ((1.0 - a * a) * (1.0 - 0.25));
        const Certificate certificate = certified(separable(a, 0.5), data(1, variance));
        EXPECT_TRUE(certificate.valid);
        EXPECT_EQ(certificate.zeros, 0);
        // Squares whose density changes by up to a quarter either way are taken at their centres: the error
        // is of second order, a few per cent of 1/4 squared.
        EXPECT_NEAR(certificate.variance_ratio.at(0), 1.0, 0.02) << a;
        EXPECT_NEAR(certificate.min_singular, (1.0 - std::abs(a)) * 0.5, 1e-6);
    }
}

TEST(Certificate, PeaksOffTheNodesAreFound) {
    // 1 − 2 ρ cos α z + ρ² z²: a resonance at ω1 = ±α, variance of an AR(2) process.
    const double rho = 0.999, alpha = 2.0 * pi * 20.5 / 128.0;
    const double a1 = 2.0 * rho * std::cos(alpha), a2 = -rho * rho;
    const double variance = (1.0 - a2) / ((1.0 + a2) * ((1.0 - a2) * (1.0 - a2) - a1 * a1));
    const Certificate certificate = certified(scalar_field({{-2, 0}, {-1, 0}}, {a2, a1}), data(1, variance));
    EXPECT_TRUE(certificate.valid);
    EXPECT_NEAR(certificate.variance_ratio.at(0), 1.0, 0.02);
    // |1 − e^{2iα}| (1 − ρ) to first order in 1 − ρ.
    EXPECT_NEAR(certificate.min_singular, 2.0 * std::sin(alpha) * (1.0 - rho), 2e-6);
}

TEST(Certificate, SymmetricFieldWithoutZero) {
    const Certificate certificate =
        certified(scalar_field({{-1, 0}, {0, -1}, {0, 1}, {1, 0}}, {0.2, 0.2, 0.2, 0.2}), data(1, 2.0));
    EXPECT_TRUE(certificate.valid);
    EXPECT_EQ(certificate.zeros, 0);
    EXPECT_NEAR(certificate.min_singular, 0.2, 1e-9);
}

TEST(Certificate, SymmetricFieldWithACurveOfZeros) {
    // Λ = 1 − 0.6 (cos ω1 + cos ω2) changes sign where cos ω1 + cos ω2 = 5/3.
    const Certificate certificate =
        certified(scalar_field({{-1, 0}, {0, -1}, {0, 1}, {1, 0}}, {0.3, 0.3, 0.3, 0.3}), data(1, 2.0));
    EXPECT_FALSE(certificate.valid);
    int crossed = 0;
    for (int m = 0; m < 128; ++m) {
        for (int n = 0; n < 128; ++n) {
            int positive = 0;
            for (const auto& [row, column] : {std::pair{m, n}, {m, n + 1}, {m + 1, n}, {m + 1, n + 1}}) {
                const double value =
                    1.0 - 0.6 * (std::cos(2.0 * pi * row / 128.0) + std::cos(2.0 * pi * column / 128.0));
                if (value > 0.0) ++positive;
            }
            if (positive != 0 && positive != 4) ++crossed;
        }
    }
    EXPECT_GT(crossed, 0);
    EXPECT_EQ(certificate.zeros, crossed);
    // The search walks down to steps of 1e-7 on a slope below one.
    EXPECT_LT(certificate.min_singular, 1e-6);
}

/// ((cos ω1 − cos α)² + 1 − cos ω2 − ε) / its constant term: two loops of zeros of half-axes √ε / sin α and
/// √(2ε) around (±α, 0) when ε > 0, and none when ε < 0.
LinearField loops(double epsilon) {
    const double alpha = 2.0 * pi * 20.3 / 128.0;
    const double constant = 1.5 + std::cos(alpha) * std::cos(alpha) - epsilon;
    const double one = std::cos(alpha) / constant, two = -0.25 / constant, across = 0.5 / constant;
    return scalar_field({{-2, 0}, {-1, 0}, {0, -1}, {0, 1}, {1, 0}, {2, 0}},
                        {two, one, across, across, one, two});
}

TEST(Certificate, LoopsOfZerosBetweenTheNodesAreFound) {
    // Half-axes 0.004 and 0.0045: a tenth of the spacing, and no node sees a sign change.
    const Certificate hidden = certified(loops(1e-5), data(1, 1e9));
    EXPECT_FALSE(hidden.valid);
    EXPECT_EQ(hidden.zeros, 2);
    const Certificate clear = certified(loops(-1e-5), data(1, 1e9));
    EXPECT_TRUE(clear.valid);
    EXPECT_EQ(clear.zeros, 0);
}

TEST(Certificate, ComplexPointZerosAreCounted) {
    // 1 = 0.6 (e^{iω1} + e^{iω2}) at ω2 = −ω1 = ±acos(1/1.2).
    const Certificate certificate = certified(scalar_field({{0, -1}, {-1, 0}}, {0.6, 0.6}), data(1, 1e9));
    EXPECT_FALSE(certificate.valid);
    EXPECT_EQ(certificate.zeros, 2);
    EXPECT_LT(certificate.min_singular, 1e-6);
}

TEST(Certificate, PairsOfZerosInsideOneSquareAreFound) {
    // With a + b = 1 + δ two zeros of opposite sign lie √(2δ) from the origin, inside the square of the node
    // there: its turn is none. With a + b = 1 − δ there is no zero, although Λ comes as close to it.
    for (const double delta : {1e-3, 1e-4, 1e-5}) {
        const double a = 0.5 * (1.0 + delta), b = 0.5 * (1.0 - delta);
        const Certificate hidden = certified(scalar_field({{0, -1}, {-1, 0}}, {a, a}), data(1, 1e9));
        EXPECT_FALSE(hidden.valid) << delta;
        EXPECT_EQ(hidden.zeros, 2) << delta;
        const Certificate clear = certified(scalar_field({{0, -1}, {-1, 0}}, {b, b}), data(1, 1e9));
        EXPECT_TRUE(clear.valid) << delta;
        EXPECT_EQ(clear.zeros, 0) << delta;
        EXPECT_NEAR(clear.min_singular, delta, 1e-9);
    }
}

TEST(Certificate, UnitRootIsInvalid) {
    const Certificate symmetric =
        certified(scalar_field({{-1, 0}, {0, -1}, {0, 1}, {1, 0}}, {0.25, 0.25, 0.25, 0.25}), data(1, 1e9));
    EXPECT_FALSE(symmetric.valid);
    const Certificate causal = certified(scalar_field({{0, -1}, {-1, 0}}, {0.5, 0.5}), data(1, 1e9));
    EXPECT_FALSE(causal.valid);
    EXPECT_LT(causal.min_singular, 1e-12);
}

TEST(Certificate, ZerosDoNotDependOnTheBasisOfPlanes) {
    const LinearField quiet = separable(0.5, 0.3), two_zeros = scalar_field({{0, -1}, {-1, 0}}, {0.6, 0.6});
    const LinearField other = scalar_field({{0, -1}, {-2, 0}}, {0.6, 0.6});  // four: ω1 enters doubled
    EXPECT_EQ(certified(mixed({quiet, two_zeros}), data(2, 1.0)).zeros, 2);
    EXPECT_EQ(certified(mixed({quiet, two_zeros, other}), data(3, 1.0)).zeros, 6);
    EXPECT_EQ(certified(mixed({two_zeros, quiet, quiet, other}), data(4, 1.0)).zeros, 6);
    EXPECT_EQ(certified(mixed({quiet, quiet, other, quiet, quiet}), data(5, 1.0)).zeros, 4);
    EXPECT_TRUE(certified(mixed({quiet, separable(-0.7, 0.2), quiet}), data(3, 2.0)).valid);
    const double a = 0.5 * (1.0 + 1e-5);
    EXPECT_EQ(certified(mixed({quiet, scalar_field({{0, -1}, {-1, 0}}, {a, a})}), data(2, 1.0)).zeros, 2);
}

TEST(Certificate, RealPlanesAmongOthers) {
    const LinearField curve = scalar_field({{-1, 0}, {0, -1}, {0, 1}, {1, 0}}, {0.3, 0.3, 0.3, 0.3});
    const LinearField calm = scalar_field({{-1, 0}, {0, -1}, {0, 1}, {1, 0}}, {0.1, 0.2, 0.2, 0.1});
    const Certificate all_real = certified(mixed({calm, curve}), data(2, 1.0));
    EXPECT_FALSE(all_real.valid);
    EXPECT_GT(all_real.zeros, 0);
    EXPECT_TRUE(certified(mixed({calm, calm}), data(2, 1.0)).valid);
    // One plane's curve among complex planes: det Λ is complex, and its zeros are a curve all the same.
    EXPECT_FALSE(certified(mixed({separable(0.5, 0.3), curve}), data(2, 1.0)).valid);
}

TEST(Certificate, RatiosAreThoseOfTheField) {
    for (const int d : {2, 3, 6}) {
        const LinearField field =
            reference::random_field(d, neighbourhood(3, NeighbourhoodKind::symmetric), 0.8, 5);
        const LagCovariance model = model_covariance(field, {96, 96}, {0, 0});
        LagCovariance statistic = data(d, 1.0);
        for (int i = 0; i < d; ++i) statistic.set(i, i, {}, 1.0 + i);
        const Certificate certificate = certified(field, statistic);
        EXPECT_TRUE(certificate.valid);
        for (int i = 0; i < d; ++i) {
            EXPECT_NEAR(certificate.variance_ratio.at(static_cast<std::size_t>(i)),
                        model(i, i, {}) / (1.0 + i), 1e-9);
        }
        // |λ| >= 1 − 0.8 in every row and column; the largest change of a diagonally dominant matrix is 1.8.
        EXPECT_GT(certificate.min_singular, 0.2 / std::sqrt(d));
        EXPECT_LT(certificate.min_singular, 1.0);
    }
}

TEST(Certificate, ImplausibleVarianceIsInvalid) {
    const LinearField field = separable(0.9, 0.9);
    const double variance = 1.0 / (0.19 * 0.19);
    EXPECT_TRUE(certified(field, data(1, variance / 9.0)).valid);
    EXPECT_FALSE(certified(field, data(1, variance / 11.0)).valid);
}

TEST(Certificate, RefusesOtherData) {
    EXPECT_THROW((void)certified(separable(0.5, 0.5), data(2, 1.0)), InputError);
}

/// Λ(0) = margin, its least value: I − a (2 cos ω1 + 2 cos ω2) with 4 a = 1 − margin on both planes, turned.
MrfModel nearly_singular(MrfForm form, double margin) {
    const double a = 0.25 * (1.0 - margin), mixing = 0.2 * a;
    LinearField field;
    field.planes = 2;
    field.kind = NeighbourhoodKind::symmetric;
    field.offsets = neighbourhood(1, field.kind);
    // Eigenvalues a and 0.6 a of the coefficients.
    for (std::size_t s = 0; s < field.offsets.size(); ++s)
        field.coefficients.insert(field.coefficients.end(), {a - mixing, mixing, mixing, a - mixing});
    field.noise_covariance = {1.0, 0.0, 0.0, 1.0};
    return MrfModel{field, form};
}

TEST(Certificate, MarkovModelsNearlySingularAreDecided) {
    for (const MrfForm form : {MrfForm::mmrf, MrfForm::pmrf}) {
        for (const double margin : {1e-2, 1e-5, 1e-6}) {
            const MrfModel model = nearly_singular(form, margin);
            const LagCovariance own = model_covariance(model, {512, 512}, {0, 0});
            const Certificate certificate = certify(model, own);
            EXPECT_EQ(certificate.zeros, 0) << margin;
            EXPECT_NEAR(certificate.min_singular, margin, 1e-3 * margin) << margin;
        }
        EXPECT_TRUE(certify(nearly_singular(form, 1e-2),
                            model_covariance(nearly_singular(form, 1e-2), {512, 512}, {0, 0}))
                        .valid);
        // Indefinite around ω = 0: never valid, however small the part.
        for (const double margin : {-1e-2, -1e-6}) {
            LagCovariance data(2, {64, 64}, {0, 0});
            for (int i = 0; i < 2; ++i) data.set(i, i, {0, 0}, 1.0);
            EXPECT_FALSE(certify(nearly_singular(form, margin), data).valid) << margin;
        }
    }
}

}  // namespace
}  // namespace btfield
