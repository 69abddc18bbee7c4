#include "host/fit/sar_likelihood.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>

#include "btfield/error.hpp"
#include "btfield/fit.hpp"
#include "btfield/image_io.hpp"
#include "btfield/synthesis.hpp"
#include "host/fit/sar_newton.hpp"
#include "host/fit/sar_objective.hpp"
#include "host/spectrum/spectral_density.hpp"
#include "tests/places.hpp"
#include "tests/reference/fields.hpp"

namespace btfield {

using namespace detail;

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

const std::filesystem::path pictures = test::data_folder();

/// A valid field; for one plane on a symmetric support a_s = a_{−s}, as the fit has it.
LinearField known_field(int planes, const std::vector<Offset>& offsets, bool symmetric, unsigned seed) {
    LinearField field = reference::random_field(planes, offsets, 0.9, seed);
    if (planes == 1 && symmetric) {
        for (std::size_t s = 0; s < offsets.size(); ++s)
            field.coefficients[offsets.size() - 1 - s] = field.coefficients[s];
    }
    return field;
}

/// On this torus a field whose rows of |A| sum to 0.9 at most has the covariances of the infinite lattice to
/// better than 0.9^64 times its variance, at lags of a few pixels.
LagCovariance covariances_of(const LinearField& field, const std::vector<Offset>& offsets) {
    return model_covariance(field, {256, 256}, difference_box(offsets));
}

/// Unknowns in the order of the entries; centre lower triangular.
SarObjective::Layout layout_of(int planes, const std::vector<Offset>& offsets) {
    SarObjective::Layout layout;
    layout.planes = planes;
    layout.terms = {{}};
    layout.terms.insert(layout.terms.end(), offsets.begin(), offsets.end());
    for (std::size_t s = 0; s < layout.terms.size(); ++s) {
        for (int i = 0; i < planes; ++i) {
            for (int j = 0; j < planes; ++j) layout.place.push_back(s == 0 && j > i ? -1 : layout.unknowns++);
        }
    }
    return layout;
}

MatrixXd random_moments(Index count, unsigned seed) {
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal;
    MatrixXd root(count, count);
    for (double& value : root.reshaped()) value = normal(engine);
    return root * root.transpose() / static_cast<double>(count);
}

TEST(SarLikelihood, DerivativesAreThoseOfTheValue) {
    const auto offsets = neighbourhood(2, NeighbourhoodKind::symmetric);
    for (const int d : {1, 2, 4}) {
        for (const double strength : {0.0, 0.7}) {
            const SarObjective::Layout layout = layout_of(d, offsets);
            SarObjective objective(layout, random_moments(static_cast<Index>(layout.terms.size()) * d, 3));
            objective.set_grid(16);
            objective.set_guard({strength, 0.1});
            std::mt19937 engine(11);
            std::uniform_real_distribution<double> uniform(-0.05, 0.05);
            VectorXd x(layout.unknowns);
            for (double& value : x) value = uniform(engine);
            for (int i = 0; i < d; ++i) x[layout.place[static_cast<std::size_t>(i * d + i)]] = 1.0;
            ASSERT_TRUE(std::isfinite(objective.value(x)));
            EXPECT_EQ(objective.is_guarded(), strength > 0.0);
            const SarObjective::Derivatives at = objective.derivatives();
            EXPECT_LE((objective.gradient() - at.gradient).cwiseAbs().maxCoeff(), 1e-12);
            // Central differences: the third derivative is of order 10, rounding 1e-15 / h.
            const double h = 1e-5, tolerance = 10.0 * 10.0 * h * h + 10.0 * 1e-15 / h;
            for (Index k = 0; k < layout.unknowns; k += 1 + layout.unknowns / 12) {
                VectorXd shifted = x;
                shifted[k] += h;
                const double above = objective.value(shifted);
                const VectorXd gradient_above = objective.gradient();
                shifted[k] -= 2.0 * h;
                const double below = objective.value(shifted);
                const VectorXd gradient_below = objective.gradient();
                EXPECT_NEAR((above - below) / (2.0 * h), at.gradient[k], tolerance);
                if (strength > 0.0) continue;  // that Hessian is Gauss-Newton's
                const VectorXd column = (gradient_above - gradient_below) / (2.0 * h);
                for (Index l = 0; l <= k; ++l) EXPECT_NEAR(column[l], at.hessian(k, l), 10.0 * tolerance);
            }
        }
    }
}

TEST(SarLikelihood, RecoversAModelFromItsCovariances) {
    struct Case {
        int planes, order;
        NeighbourhoodKind kind;
        NoiseForm noise;
    };
    for (const Case c : {Case{1, 3, NeighbourhoodKind::symmetric, NoiseForm::full},
                         Case{1, 2, NeighbourhoodKind::half, NoiseForm::full},
                         Case{2, 1, NeighbourhoodKind::symmetric, NoiseForm::full},
                         Case{3, 2, NeighbourhoodKind::causal, NoiseForm::full},
                         Case{3, 1, NeighbourhoodKind::half, NoiseForm::diagonal}}) {
        const auto offsets = neighbourhood(c.order, c.kind);
        LinearField truth = known_field(c.planes, offsets, c.kind == NeighbourhoodKind::symmetric, 5);
        for (int i = 0; i < c.planes; ++i) {
            for (int j = 0; j < c.planes; ++j) {
                if (c.noise == NoiseForm::diagonal && i != j)
                    truth.noise_covariance[static_cast<std::size_t>(i * c.planes + j)] = 0.0;
            }
        }
        const LagCovariance statistic = covariances_of(truth, offsets);
        const SarLikelihoodFit fit = fit_sar_likelihood(statistic, {c.kind, offsets}, c.noise);
        EXPECT_TRUE(fit.converged);
        EXPECT_TRUE(fit.examination.certificate.valid);
        // f is quadratic there with curvature of order one: a gradient of 1e-7 is an error of about as much.
        EXPECT_LE(fit.gradient, 1e-7);
        for (std::size_t k = 0; k < truth.coefficients.size(); ++k)
            EXPECT_NEAR(fit.model.coefficients[k], truth.coefficients[k], 1e-5) << c.planes << " " << k;
        for (int i = 0; i < c.planes * c.planes; ++i) {
            EXPECT_NEAR(fit.model.noise_covariance[static_cast<std::size_t>(i)],
                        truth.noise_covariance[static_cast<std::size_t>(i)], 1e-5);
        }
    }
}

TEST(SarLikelihood, CertifiesWhereLeastSquaresDoNot) {
    const Image image = read_picture(pictures / "cork.png").image;
    const auto offsets = neighbourhood(2, NeighbourhoodKind::symmetric);
    const LagCovariance statistic = lag_covariance(image, difference_box(offsets));
    const NeighbourhoodKind kind = NeighbourhoodKind::symmetric;
    EXPECT_FALSE(certify(fit_sar(statistic, {kind, offsets}, NoiseForm::full), statistic).valid);
    const SarLikelihoodFit fit = fit_sar_likelihood(statistic, {kind, offsets}, NoiseForm::full);
    EXPECT_TRUE(fit.converged);
    EXPECT_TRUE(fit.examination.certificate.valid);
    EXPECT_EQ(fit.examination.certificate.zeros, 0);
    EXPECT_TRUE(certify(fit.model, statistic).valid);
    EXPECT_TRUE(std::isfinite(fit.log_likelihood));
    const SarLikelihoodFit again = fit_sar_likelihood(statistic, {kind, offsets}, NoiseForm::full);
    EXPECT_EQ(fit.model.coefficients, again.model.coefficients);
    EXPECT_EQ(fit.model.noise_covariance, again.model.noise_covariance);
}

TEST(SarLikelihood, CertifiesWhereWhiteNoiseLeadsToZeros) {
    const Image image = read_picture(pictures / "bark.png").image;
    const auto offsets = neighbourhood(5, NeighbourhoodKind::symmetric);
    const LagCovariance statistic = lag_covariance(image, difference_box(offsets));
    const SarLikelihoodFit fit =
        fit_sar_likelihood(statistic, {NeighbourhoodKind::symmetric, offsets}, NoiseForm::diagonal);
    EXPECT_TRUE(fit.examination.certificate.valid);
    for (const double ratio : fit.examination.certificate.variance_ratio) EXPECT_NEAR(ratio, 1.0, 0.1);
}

TEST(SarLikelihood, TellsPlanesThatRepeatApart) {
    const Image grey = read_picture(pictures / "grass.png").image;
    Image image(grey.size(), 3);
    for (int i = 0; i < 3; ++i) std::ranges::copy(grey.plane(0), image.plane(i).begin());
    const auto offsets = neighbourhood(2, NeighbourhoodKind::symmetric);
    const LagCovariance statistic = lag_covariance(image, difference_box(offsets));
    EXPECT_THROW((void)fit_sar(statistic, {NeighbourhoodKind::symmetric, offsets}, NoiseForm::full),
                 InputError);
    const SarLikelihoodFit fit =
        fit_sar_likelihood(statistic, {NeighbourhoodKind::symmetric, offsets}, NoiseForm::full);
    EXPECT_TRUE(fit.examination.certificate.valid);
    for (const double ratio : fit.examination.certificate.variance_ratio) EXPECT_NEAR(ratio, 1.0, 0.1);
    const LagCovariance own = lag_covariance(grey, difference_box(offsets));
    const SarLikelihoodFit alone =
        fit_sar_likelihood(own, {NeighbourhoodKind::symmetric, offsets}, NoiseForm::full);
    const std::vector<double>& ratios = fit.examination.certificate.variance_ratio;
    EXPECT_NEAR(ratios[0], alone.examination.certificate.variance_ratio[0], 0.1);
}

TEST(SarLikelihood, DescendsThroughAdmissiblePointsOnly) {
    const auto offsets = neighbourhood(1, NeighbourhoodKind::symmetric);
    const SarObjective::Layout layout = layout_of(2, offsets);
    SarObjective objective(layout, random_moments(static_cast<Index>(layout.terms.size()) * 2, 5));
    objective.set_grid(32);
    VectorXd x = VectorXd::Zero(layout.unknowns);
    for (const Index i : {0, 3}) x[layout.place[static_cast<std::size_t>(i)]] = 1.0;
    const double start = objective.value(x);
    const Descent free = descend(objective, x, 1e-15, 200, Pace::cautious);
    ASSERT_TRUE(free.converged);
    const double limit = 0.5 * (free.x - x).norm();
    const auto near = [&](const VectorXd& at) { return (at - x).norm() <= limit; };
    const Descent bounded = descend(objective, x, 1e-15, 200, Pace::cautious, near);
    EXPECT_FALSE(bounded.converged);
    EXPECT_TRUE(near(bounded.x));
    EXPECT_GT((bounded.x - x).norm(), 0.9 * limit);
    EXPECT_LT(bounded.value, start);
    EXPECT_GT(bounded.value, free.value);
    EXPECT_EQ(bounded.value, objective.value(bounded.x));
}

TEST(SarLikelihood, IsNeverBelowThatOfLeastSquares) {
    int compared = 0;
    for (const char* file : {"cork.png", "landsat.tif", "grass.png"}) {
        const Image image = read_picture(pictures / file).image;
        const auto offsets = neighbourhood(1, NeighbourhoodKind::half);
        const LagCovariance statistic = lag_covariance(image, difference_box(offsets));
        const SarModel least_squares =
            fit_sar(statistic, {NeighbourhoodKind::half, offsets}, NoiseForm::full);
        const Examination examined = examine(least_squares, statistic);
        const SarLikelihoodFit fit =
            fit_sar_likelihood(statistic, {NeighbourhoodKind::half, offsets}, NoiseForm::full);
        ASSERT_TRUE(fit.examination.certificate.valid) << file;
        if (!examined.certificate.valid) continue;
        ++compared;
        // Σ of least squares is the errors' covariance: tr(Σ⁻¹ Ê) = d.
        const double d = image.planes();
        const double below =
            -0.5 * (d * std::log(2.0 * std::numbers::pi) +
                    std::log(noise_matrix(least_squares).determinant()) - 2.0 * examined.log_determinant + d);
        EXPECT_GE(fit.log_likelihood, below - 1e-9) << file;
    }
    EXPECT_GT(compared, 0);
}

TEST(SarLikelihood, KeepsPerPairSets) {
    const int d = 2;
    const auto offsets = neighbourhood(2, NeighbourhoodKind::half);
    std::vector<std::uint8_t> active(offsets.size() * d * d);
    for (std::size_t k = 0; k < active.size(); ++k) active[k] = k % 3 == 0 ? 1 : 0;
    LinearField truth = known_field(d, offsets, false, 8);
    truth.noise_covariance[1] = truth.noise_covariance[2] = 0.0;
    for (std::size_t k = 0; k < active.size(); ++k) {
        if (active[k] == 0) truth.coefficients[k] = 0.0;
    }
    const LagCovariance statistic = covariances_of(truth, offsets);
    const SarLikelihoodFit fit =
        fit_sar_likelihood(statistic, {NeighbourhoodKind::custom, offsets, active}, NoiseForm::diagonal);
    EXPECT_TRUE(fit.examination.certificate.valid);
    EXPECT_EQ(fit.model.active, active);
    for (std::size_t k = 0; k < active.size(); ++k) {
        if (active[k] == 0) {
            EXPECT_EQ(fit.model.coefficients[k], 0.0);
        } else {
            EXPECT_NEAR(fit.model.coefficients[k], truth.coefficients[k], 1e-5);
        }
    }
    EXPECT_THROW(
        (void)fit_sar_likelihood(statistic, {NeighbourhoodKind::custom, offsets, active}, NoiseForm::full),
        InputError);
    EXPECT_THROW((void)fit_sar_likelihood({}, {NeighbourhoodKind::half, offsets}, NoiseForm::full),
                 InputError);
}

TEST(SarLikelihoodLong, RecoversModelsFromTheirTextures) {
    Device device;
    for (const int d : {1, 3}) {
        const auto kind = d == 1 ? NeighbourhoodKind::symmetric : NeighbourhoodKind::half;
        const auto support = neighbourhood(2, kind);
        const LinearField field = known_field(d, support, d == 1, 21);
        SarModel model;
        static_cast<LinearField&>(model) = field;
        TextureModel texture;
        texture.kind = ModelKind::msar3d;
        texture.size = {1024, 1024};
        texture.planes = d;
        texture.mean.assign(static_cast<std::size_t>(d), 0.0);
        LevelModel level;
        level.size = texture.size;
        level.models = {model};
        level.certificate.valid = true;
        texture.levels.push_back(level);
        const Image image = Synthesiser(device, texture, texture.size).synthesise(7);
        LikelihoodOptions options;
        options.standard_errors = true;
        const SarLikelihoodFit fit = fit_sar_likelihood(lag_covariance(image, difference_box(support)),
                                                        {kind, support}, NoiseForm::full, options);
        ASSERT_TRUE(fit.examination.certificate.valid);
        ASSERT_EQ(fit.standard_errors.size(), field.coefficients.size());
        double squares = 0.0;
        for (std::size_t k = 0; k < field.coefficients.size(); ++k) {
            const double off = (fit.model.coefficients[k] - field.coefficients[k]) / fit.standard_errors[k];
            EXPECT_LE(std::abs(off), 4.0) << k;
            squares += off * off;
        }
        // Errors in units of their own size: the mean square is near one; over four independent ones it is
        // below 0.05 or above 5 with probability 1e-3 (chi-squared).
        EXPECT_GT(squares / static_cast<double>(field.coefficients.size()), 0.02);
        EXPECT_LT(squares / static_cast<double>(field.coefficients.size()), 5.0);
    }
}

}  // namespace
}  // namespace btfield
