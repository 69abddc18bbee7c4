#include "host/fit/mrf_least_squares.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <complex>
#include <filesystem>
#include <limits>
#include <numbers>
#include <random>
#include <string>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "tests/places.hpp"
#include "tests/reference/algebra.hpp"
#include "tests/reference/fields.hpp"
#include "tests/reference/mrf_least_squares.hpp"
#include "tests/reference/spectral_factor.hpp"

namespace btfield {

using namespace detail;

namespace {

using Complex = std::complex<double>;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;

/// Correlated along both axes and between planes, of unlike deviations.
Image texture(Size size, int planes) {
    std::mt19937 engine(7);
    std::normal_distribution<float> normal;
    Image white(size, planes), image(size, planes);
    for (float& value : white.values()) value = normal(engine);
    for (int p = 0; p < planes; ++p)
        for (int r = 0; r < size.height; ++r)
            for (int c = 0; c < size.width; ++c)
                image.at(p, r, c) =
                    static_cast<float>(p + 1) *
                    (0.5F + white.at(p, r, c) + 0.6F * white.at(p, (r + 1) % size.height, c) +
                     0.4F * white.at((p + 1) % planes, r, (c + 1) % size.width) + 0.5F * white.at(0, r, c));
    return image;
}

LagCovariance statistic_of(const Image& image, const std::vector<Offset>& offsets) {
    return lag_covariance(image, difference_box(offsets));
}

std::size_t opposite(const std::vector<Offset>& offsets, std::size_t s) {
    std::size_t other = 0;
    while (offsets[other] != -offsets[s]) ++other;
    return other;
}

/// The symmetry of the model's form.
void expect_symmetric(const MrfModel& model) {
    const MatrixXd inverse = reference::inverse(reference::noise_covariance(model));
    for (std::size_t s = 0; s < model.offsets.size(); ++s) {
        MatrixXd here = reference::coefficients(model, s),
                 there = reference::coefficients(model, opposite(model.offsets, s));
        if (model.form == MrfForm::pmrf) {
            EXPECT_EQ(here, there.transpose());
            continue;
        }
        here = reference::product(inverse, here), there = reference::product(inverse, there);
        // Two products with Σ's root and its inverse.
        const double bound = 16.0 * model.planes * std::numeric_limits<double>::epsilon() * inverse.norm() *
                             reference::noise_covariance(model).norm() * here.norm();
        EXPECT_LE((here - there.transpose()).norm(), bound);
    }
}

void expect_close(const MrfModel& model, const std::vector<MatrixXd>& a, const MatrixXd& sigma,
                  double tolerance) {
    double difference = 0.0, scale = 0.0;
    for (std::size_t s = 0; s < a.size(); ++s) {
        difference += (reference::coefficients(model, s) - a[s]).squaredNorm();
        scale += a[s].squaredNorm();
    }
    EXPECT_LE(std::sqrt(difference), tolerance * std::sqrt(scale));
    EXPECT_LE((reference::noise_covariance(model) - sigma).norm(), tolerance * sigma.norm());
}

/// Normal equations square the condition of the design, here below 1e3: 1e6 units of float64, and the lag
/// covariances' sums.
constexpr double same_numbers = 1e-9;

TEST(MrfLeastSquares, DiagonalMmrfIsThePapersIteration) {
    for (const int planes : {1, 2, 3})
        for (const int order : {1, 2}) {
            const Image image = texture({17, 14}, planes);
            const auto offsets = neighbourhood(order, NeighbourhoodKind::symmetric);
            const LagCovariance statistic = statistic_of(image, offsets);
            // What an iteration solves for comes with its own ratios; the model's come with the next ones.
            // Where they agree, so do the models.
            const MrfEstimate found =
                fit_mmrf(statistic, {NeighbourhoodKind::symmetric, offsets}, NoiseForm::diagonal);
            ASSERT_TRUE(found.converged);
            const auto expected = reference::mmrf_diagonal(image, offsets, found.iterations);
            expect_close(found.model, expected.a, expected.sigma.diagonal().asDiagonal(), same_numbers);
            expect_symmetric(found.model);
            EXPECT_EQ(found.model.form, MrfForm::mmrf);
        }
}

TEST(MrfLeastSquares, FullMmrfIsWeightedLeastSquares) {
    for (const int planes : {1, 2, 3}) {
        const Image image = texture({16, 15}, planes);
        const auto offsets = neighbourhood(planes == 3 ? 1 : 2, NeighbourhoodKind::symmetric);
        const MrfEstimate found =
            fit_mmrf(statistic_of(image, offsets), {NeighbourhoodKind::symmetric, offsets}, NoiseForm::full);
        ASSERT_TRUE(found.converged);
        const auto expected = reference::mmrf_full(image, offsets, found.iterations);
        expect_close(found.model, expected.a, expected.sigma, same_numbers);
        expect_symmetric(found.model);
    }
}

TEST(MrfLeastSquares, PmrfIsTheFirstIteration) {
    for (const int planes : {1, 2, 3}) {
        const Image image = texture({17, 14}, planes);
        const auto offsets = neighbourhood(2, NeighbourhoodKind::symmetric);
        const LagCovariance statistic = statistic_of(image, offsets);
        const auto expected = reference::mmrf_diagonal(image, offsets, 1);
        const MrfEstimate full =
            fit_pmrf(statistic, {NeighbourhoodKind::symmetric, offsets}, NoiseForm::full);
        expect_close(full.model, expected.a, expected.sigma, same_numbers);
        const MrfEstimate diagonal =
            fit_pmrf(statistic, {NeighbourhoodKind::symmetric, offsets}, NoiseForm::diagonal);
        expect_close(diagonal.model, expected.a, expected.sigma.diagonal().asDiagonal(), same_numbers);
        for (const MrfEstimate& e : {full, diagonal}) {
            EXPECT_EQ(e.iterations, 1);
            EXPECT_TRUE(e.converged);
            EXPECT_EQ(e.model.form, MrfForm::pmrf);
            expect_symmetric(e.model);
        }
    }
}

/// Valid by diagonal dominance: A_s = R P_s R⁻¹ with Σ_s ‖P_s‖ = strength < 1, Σ = R Rᵀ.
MrfModel valid_model(int planes, int order, const MatrixXd& root, double strength = 0.7) {
    std::mt19937 engine(5);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    MrfModel model;
    model.planes = planes;
    model.kind = NeighbourhoodKind::symmetric;
    model.offsets = neighbourhood(order, NeighbourhoodKind::symmetric);
    std::vector<MatrixXd> p(model.offsets.size());
    double sum = 0.0;
    for (std::size_t s = 0; s < p.size(); ++s) {
        if (model.offsets[s] < Offset{}) continue;
        p[s] = MatrixXd::NullaryExpr(planes, planes, [&] { return uniform(engine); });
        p[opposite(model.offsets, s)] = p[s].transpose();
        sum += 2.0 * p[s].norm();
    }
    const MatrixXd inverse = reference::inverse(root);
    for (const MatrixXd& m : p) {
        const MatrixXd a = (strength / sum) * reference::product(root, m, inverse);
        for (int i = 0; i < planes; ++i)
            for (int j = 0; j < planes; ++j) model.coefficients.push_back(a(i, j));
    }
    const MatrixXd sigma = reference::product(root, MatrixXd(root.transpose()));
    for (int i = 0; i < planes; ++i)
        for (int j = 0; j < planes; ++j) model.noise_covariance.push_back(sigma(i, j));
    return model;
}

/// The model's own covariances on a torus: C_ij(s) = mean_t S_{t,ij} exp(−√−1 ω_st), S = Λ⁻¹ Σ.
LagCovariance exact_statistic(const MrfModel& model, Size size) {
    const Offset box = difference_box(model.offsets);
    LagCovariance statistic(model.planes, size, box);
    const MatrixXcd sigma = reference::noise_covariance(model);
    std::vector<MatrixXcd> densities;
    for (int ky = 0; ky < size.height; ++ky)
        for (int kx = 0; kx < size.width; ++kx)
            densities.push_back(reference::product(
                reference::inverse(reference::transfer_matrix(model, size, kx, ky)), sigma));
    for (int row = 0; row <= box.row; ++row)
        for (int column = row == 0 ? 0 : -box.column; column <= box.column; ++column) {
            MatrixXcd c = MatrixXcd::Zero(model.planes, model.planes);
            for (int ky = 0; ky < size.height; ++ky)
                for (int kx = 0; kx < size.width; ++kx) {
                    const double turns = static_cast<double>(ky) * row / size.height +
                                         static_cast<double>(kx) * column / size.width;
                    c += densities[static_cast<std::size_t>(ky * size.width + kx)] *
                         std::polar(1.0 / static_cast<double>(area(size)), -2.0 * std::numbers::pi * turns);
                }
            for (int i = 0; i < model.planes; ++i)
                for (int j = 0; j < model.planes; ++j) statistic.set(i, j, {row, column}, c(i, j).real());
        }
    return statistic;
}

void expect_recovered(const MrfModel& model, const MrfEstimate& found) {
    EXPECT_TRUE(found.converged) << found.iterations;
    std::vector<MatrixXd> a;
    for (std::size_t s = 0; s < model.offsets.size(); ++s) a.push_back(reference::coefficients(model, s));
    expect_close(found.model, a, reference::noise_covariance(model), same_numbers);
}

TEST(MrfLeastSquares, RecoversMmrfFromItsCovariances) {
    // The errors of an MMRF are orthogonal to all neighbours (P4 eq. 41), so least squares with the right
    // ratios is exact; from wrong ones the iteration finds them.
    for (const int planes : {1, 2, 3})
        for (const int order : {1, 3}) {
            SCOPED_TRACE(std::to_string(planes) + " planes, order " + std::to_string(order));
            MatrixXd root = MatrixXd::Zero(planes, planes);
            for (int i = 0; i < planes; ++i) root(i, i) = 1.0 + 0.7 * i;
            const MrfModel diagonal = valid_model(planes, order, root);
            expect_recovered(diagonal,
                             fit_mmrf(exact_statistic(diagonal, {20, 18}),
                                      {NeighbourhoodKind::symmetric, diagonal.offsets}, NoiseForm::diagonal));
            for (int i = 0; i < planes; ++i)
                for (int j = 0; j < i; ++j) root(i, j) = 0.9 - 0.3 * j;
            const MrfModel full = valid_model(planes, order, root);
            expect_recovered(full, fit_mmrf(exact_statistic(full, {20, 18}),
                                            {NeighbourhoodKind::symmetric, full.offsets}, NoiseForm::full));
        }
}

TEST(MrfLeastSquares, RecoversPmrfOfEqualNoise) {
    // With Σ = σI the PMRF is the MMRF.
    for (const int planes : {1, 3}) {
        const MrfModel model = valid_model(planes, 2, 1.7 * MatrixXd::Identity(planes, planes));
        const LagCovariance statistic = exact_statistic(model, {20, 18});
        for (const NoiseForm noise : {NoiseForm::full, NoiseForm::diagonal})
            expect_recovered(model,
                             fit_pmrf(statistic, {NeighbourhoodKind::symmetric, model.offsets}, noise));
    }
}

TEST(MrfLeastSquares, FullMmrfTurnsWithThePlanes) {
    const Image image = texture({31, 28}, 3);
    MatrixXd turn(3, 3);
    turn << 2.0, -0.5, 0.1, 0.3, 0.02, 0.4, -1.0, 0.2, 5.0;
    Image turned(image.size(), 3);
    for (int r = 0; r < image.height(); ++r)
        for (int c = 0; c < image.width(); ++c)
            for (int i = 0; i < 3; ++i)
                turned.at(i, r, c) = static_cast<float>(turn(i, 0)) * image.at(0, r, c) +
                                     static_cast<float>(turn(i, 1)) * image.at(1, r, c) +
                                     static_cast<float>(turn(i, 2)) * image.at(2, r, c);
    const auto offsets = neighbourhood(2, NeighbourhoodKind::symmetric);
    const auto kind = NeighbourhoodKind::symmetric;
    const MrfEstimate plain = fit_mmrf(statistic_of(image, offsets), {kind, offsets}, NoiseForm::full);
    const MrfEstimate other = fit_mmrf(statistic_of(turned, offsets), {kind, offsets}, NoiseForm::full);
    std::vector<MatrixXd> a;
    for (std::size_t s = 0; s < offsets.size(); ++s)
        a.push_back(
            reference::product(turn, reference::coefficients(plain.model, s), reference::inverse(turn)));
    // The turned pixels are rounded to float32, some 1e-7 of their deviation, and turning back costs cond² =
    // 1e3.
    expect_close(other.model, a, reference::congruent(turn, reference::noise_covariance(plain.model)), 1e-4);
}

TEST(MrfLeastSquares, PerPairSets) {
    const Image image = texture({31, 28}, 2);
    const auto offsets = neighbourhood(1, NeighbourhoodKind::symmetric);
    const LagCovariance statistic = statistic_of(image, offsets);
    // Every plane by itself: both forms are the two fields of one plane.
    std::vector<std::uint8_t> active;
    for (std::size_t s = 0; s < offsets.size(); ++s) active.insert(active.end(), {1, 0, 0, 1});
    for (int i = 0; i < 2; ++i) {
        LagCovariance alone(1, image.size(), statistic.box());
        for (int r = 0; r <= alone.box().row; ++r)
            for (int c = -alone.box().column; c <= alone.box().column; ++c)
                alone.set(0, 0, {r, c}, statistic(i, i, {r, c}));
        const MrfEstimate one = fit_pmrf(alone, {NeighbourhoodKind::custom, offsets}, NoiseForm::full);
        for (const MrfEstimate& both :
             {fit_mmrf(statistic, {NeighbourhoodKind::custom, offsets, active}, NoiseForm::diagonal),
              fit_pmrf(statistic, {NeighbourhoodKind::custom, offsets, active}, NoiseForm::diagonal)}) {
            EXPECT_EQ(both.model.active, active);
            for (std::size_t s = 0; s < offsets.size(); ++s) {
                EXPECT_NEAR(reference::coefficient(both.model, s, i, i),
                            reference::coefficient(one.model, s, 0, 0), same_numbers);
                EXPECT_EQ(reference::coefficient(both.model, s, i, 1 - i), 0.0);
            }
            EXPECT_NEAR(reference::noise(both.model, i, i), reference::noise(one.model, 0, 0),
                        same_numbers * statistic(i, i, {}));
        }
    }
    EXPECT_THROW((void)fit_mmrf(statistic, {NeighbourhoodKind::custom, offsets, active}, NoiseForm::full),
                 InputError);
    active[1] = 1;  // (s, 1, 2) without (−s, 2, 1)
    EXPECT_THROW((void)fit_mmrf(statistic, {NeighbourhoodKind::custom, offsets, active}, NoiseForm::diagonal),
                 InputError);
    EXPECT_THROW((void)fit_pmrf(statistic, {NeighbourhoodKind::custom, offsets, active}, NoiseForm::full),
                 InputError);
}

TEST(MrfLeastSquares, RefusesWhatHasNoEstimate) {
    const Image image = texture({31, 28}, 2);
    const auto offsets = neighbourhood(2, NeighbourhoodKind::symmetric);
    const LagCovariance statistic = statistic_of(image, offsets);
    for (const auto kind :
         {NeighbourhoodKind::causal, NeighbourhoodKind::half, NeighbourhoodKind::unilateral}) {
        const auto lopsided = neighbourhood(2, kind);
        EXPECT_THROW((void)fit_mmrf(statistic, {kind, lopsided}, NoiseForm::full), InputError);
        EXPECT_THROW((void)fit_pmrf(statistic, {kind, lopsided}, NoiseForm::full), InputError);
    }
    const auto kind = NeighbourhoodKind::symmetric;
    EXPECT_THROW((void)fit_mmrf(statistic, {kind, {}}, NoiseForm::full), InputError);
    EXPECT_THROW((void)fit_mmrf(statistic, {kind, {{0, 0}}}, NoiseForm::full), InputError);
    EXPECT_THROW((void)fit_mmrf(statistic, {kind, neighbourhood(8, kind)}, NoiseForm::full), InputError);
    EXPECT_THROW((void)fit_mmrf(statistic, {kind, offsets, {1, 1}}, NoiseForm::diagonal), InputError);
    EXPECT_THROW((void)fit_mmrf(statistic, {kind, offsets}, NoiseForm::full, {.iterations = 0}), InputError);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW((void)fit_mmrf(statistic, {kind, offsets}, NoiseForm::full, {.tolerance = nan}), InputError);
    // 44 offsets and 17 planes: 6358 unknowns.
    const auto many = neighbourhood(8, kind);
    LagCovariance large(17, {64, 64}, difference_box(many));
    for (int i = 0; i < 17; ++i) large.set(i, i, {}, 1.0);
    EXPECT_THROW((void)fit_pmrf(large, {kind, many}, NoiseForm::full), InputError);
    // A plane that repeats another.
    Image grey(image.size(), 2);
    for (int p = 0; p < 2; ++p)
        for (int r = 0; r < image.height(); ++r)
            for (int c = 0; c < image.width(); ++c) grey.at(p, r, c) = image.at(0, r, c);
    EXPECT_THROW((void)fit_pmrf(statistic_of(grey, offsets), {kind, offsets}, NoiseForm::full), InputError);
}

TEST(MrfLeastSquares, SaysWhenIterationsDisagree) {
    const Image image = texture({31, 28}, 3);
    const auto offsets = neighbourhood(1, NeighbourhoodKind::symmetric);
    const MrfEstimate found = fit_mmrf(statistic_of(image, offsets), {NeighbourhoodKind::symmetric, offsets},
                                       NoiseForm::full, {.iterations = 2});
    EXPECT_EQ(found.iterations, 2);
    EXPECT_FALSE(found.converged);
    expect_symmetric(found.model);
}

TEST(MrfLeastSquares, RealPicturesConverge) {
    for (const char* name : {"cork.png", "grass.png"}) {
        const std::filesystem::path path = std::filesystem::path(test::data_folder()) / name;
        const Image image = read_picture(path).image;
        for (const int order : {1, 3, 5})
            for (const NoiseForm noise : {NoiseForm::full, NoiseForm::diagonal}) {
                const auto offsets = neighbourhood(order, NeighbourhoodKind::symmetric);
                const MrfEstimate found =
                    fit_mmrf(statistic_of(image, offsets), {NeighbourhoodKind::symmetric, offsets}, noise);
                EXPECT_TRUE(found.converged) << name << ", order " << order << ", " << btfield::name(noise);
            }
    }
}

}  // namespace
}  // namespace btfield
