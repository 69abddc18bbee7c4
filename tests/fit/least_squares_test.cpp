// Least squares from lag covariances alone: CAR and MSAR coefficients, priors, supports.

#include "host/fit/least_squares.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include "btfield/certificate.hpp"
#include "btfield/error.hpp"
#include "btfield/fit.hpp"
#include "host/spectrum/spectral_density.hpp"
#include "tests/device_cases.hpp"
#include "tests/reference/fields.hpp"

namespace btfield {

using namespace detail;

namespace {

/// Prediction errors of the field on the picture's torus, means removed: [plane][pixel].
std::vector<std::vector<double>> errors(const LinearField& field, const Image& image) {
    std::vector<std::vector<double>> result;
    for (int i = 0; i < field.planes; ++i) {
        std::vector<double> plane;
        for (int r = 0; r < image.height(); ++r) {
            for (int c = 0; c < image.width(); ++c) {
                double error = static_cast<double>(image.at(i, r, c)) - reference::mean(image, i);
                for (std::size_t s = 0; s < field.offsets.size(); ++s) {
                    for (int j = 0; j < field.planes; ++j) {
                        const int row = reference::wrapped(r + field.offsets[s].row, image.height());
                        const int column = reference::wrapped(c + field.offsets[s].column, image.width());
                        error -= reference::coefficient(field, s, i, j) *
                                 (static_cast<double>(image.at(j, row, column)) - reference::mean(image, j));
                    }
                }
                plane.push_back(error);
            }
        }
        result.push_back(std::move(plane));
    }
    return result;
}

double mean_product(const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0.0;
    for (std::size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
    return sum / static_cast<double>(a.size());
}

/// mean_r e_i(r) y_j(r ⊕ s): zero for every coefficient that least squares has estimated.
double correlation(const std::vector<double>& error, const Image& image, int j, Offset s) {
    double sum = 0.0;
    for (int r = 0; r < image.height(); ++r) {
        for (int c = 0; c < image.width(); ++c) {
            const int row = reference::wrapped(r + s.row, image.height());
            const int column = reference::wrapped(c + s.column, image.width());
            sum += error[static_cast<std::size_t>(r * image.width() + c)] *
                   (static_cast<double>(image.at(j, row, column)) - reference::mean(image, j));
        }
    }
    return sum / static_cast<double>(area(image.size()));
}

BayesPrior no_prior() {
    return {0.0, 2.0};
}

TEST(LeastSquares, ExactCovariancesGiveTheCoefficientsBack) {
    for (const NeighbourhoodKind kind : {NeighbourhoodKind::causal, NeighbourhoodKind::unilateral}) {
        for (const int d : {1, 3, 5}) {
            for (const int order : {1, 3, 5}) {
                const auto offsets = neighbourhood(order, kind);
                const LinearField field =
                    reference::random_field(d, offsets, 0.8, static_cast<unsigned>(order));
                // Wrapped around the torus, the response to noise has fallen by 0.8^(64 / 2): the process is
                // causal to better than 0.8^32 = 8e-4 times coefficients that are themselves far below their
                // bound; measured 1e-12.
                const Size torus{64, 64};
                const LagCovariance exact = model_covariance(field, torus, difference_box(offsets));
                const CarModel model = fit_car(exact, {kind, offsets}, NoiseForm::full, no_prior());
                ASSERT_EQ(model.coefficients.size(), field.coefficients.size());
                for (std::size_t k = 0; k < field.coefficients.size(); ++k) {
                    EXPECT_NEAR(model.coefficients[k], field.coefficients[k], 1e-8);
                }
                const double pixels = static_cast<double>(area(torus));
                for (std::size_t k = 0; k < field.noise_covariance.size(); ++k) {
                    EXPECT_NEAR(model.noise_covariance[k],
                                field.noise_covariance[k] * pixels / (pixels + 2.0), 1e-8);
                }
            }
        }
    }
}

TEST(LeastSquares, PriorHasItsClosedForm) {
    // One plane, one offset: a = C(s) / (C(0) (1 + strength / M)), Σ = M (C(0) − 2 a C(s) + a² C(0) (1 +
    // strength / M)) / (M + β(0)).
    LagCovariance statistic(1, {10, 20}, {0, 1});
    statistic.set(0, 0, {0, 0}, 2.0);
    statistic.set(0, 0, {0, 1}, 1.2);
    for (const double strength : {0.0, 1e-3, 1.0, 50.0, 1e4}) {
        for (const double beta0 : {1.5, 40.0}) {
            const CarModel model = fit_car(statistic, {NeighbourhoodKind::custom, {{0, -1}}}, NoiseForm::full,
                                           {strength, beta0});
            const double ridge = 1.0 + strength / 200.0, a = 0.6 / ridge;
            EXPECT_NEAR(model.coefficients.at(0), a, 1e-14);
            EXPECT_NEAR(model.noise_covariance.at(0),
                        200.0 / (200.0 + beta0) * (2.0 - 2.0 * a * 1.2 + a * a * 2.0 * ridge), 1e-13);
        }
    }
}

TEST(LeastSquares, PriorGoesFromLeastSquaresToWhiteNoise) {
    const Image image = test::mixed_texture({40, 36}, 2, 1);
    const auto offsets = neighbourhood(2, NeighbourhoodKind::causal);
    const LagCovariance statistic = lag_covariance(image, difference_box(offsets));
    const auto fitted = [&](double strength) {
        return fit_car(statistic, {NeighbourhoodKind::causal, offsets}, NoiseForm::full, {strength, 2.0});
    };
    const CarModel free = fitted(0.0), loose = fitted(1e-6), tight = fitted(1e12);
    const double pixels = 40.0 * 36.0;
    for (std::size_t k = 0; k < free.coefficients.size(); ++k) {
        EXPECT_NEAR(loose.coefficients[k], free.coefficients[k], 1e-7);  // strength / M, condition below 100
        EXPECT_NEAR(tight.coefficients[k], 0.0, 1e-8);                   // M / strength
    }
    for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 2; ++j) {
            EXPECT_NEAR(reference::noise(tight, i, j), statistic(i, j, {}) * pixels / (pixels + 2.0), 1e-7);
        }
    }
}

TEST(LeastSquares, UnitsOfPlanesDoNotMatter) {
    Image image = test::mixed_texture({30, 34}, 2, 4);
    const auto offsets = neighbourhood(3, NeighbourhoodKind::causal);
    const auto fitted = [&] {
        return fit_car(lag_covariance(image, difference_box(offsets)), {NeighbourhoodKind::causal, offsets},
                       NoiseForm::full, {5.0, 2.0});
    };
    const CarModel before = fitted();
    for (float& value : image.plane(1)) value *= 1024.0F;
    const CarModel after = fitted();
    const double unit[] = {1.0, 1024.0};
    for (std::size_t s = 0; s < offsets.size(); ++s) {
        for (int i = 0; i < 2; ++i) {
            for (int j = 0; j < 2; ++j) {
                EXPECT_NEAR(reference::coefficient(after, s, i, j) * unit[j] / unit[i],
                            reference::coefficient(before, s, i, j), 1e-10);
            }
        }
    }
    for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 2; ++j) {
            EXPECT_NEAR(reference::noise(after, i, j) / (unit[i] * unit[j]), reference::noise(before, i, j),
                        1e-10);
        }
    }
}

TEST(LeastSquares, SarErrorsAreOrthogonalToTheirNeighbours) {
    for (const int d : {1, 3}) {
        const Image image = test::mixed_texture({31, 26}, d, 2);
        for (const NeighbourhoodKind kind : {NeighbourhoodKind::symmetric, NeighbourhoodKind::half}) {
            const auto offsets = neighbourhood(2, kind);
            const SarModel model =
                fit_sar(lag_covariance(image, difference_box(offsets)), {kind, offsets}, NoiseForm::full);
            const auto e = errors(model, image);
            for (int i = 0; i < d; ++i) {
                for (const Offset s : offsets) {
                    for (int j = 0; j < d; ++j) {
                        // Covariances are of order one and exact to about 1e-14, the normal equations'
                        // condition below 1e4.
                        EXPECT_NEAR(correlation(e[static_cast<std::size_t>(i)], image, j, s), 0.0, 1e-10);
                    }
                }
                for (int j = 0; j < d; ++j) {
                    EXPECT_NEAR(reference::noise(model, i, j),
                                mean_product(e[static_cast<std::size_t>(i)], e[static_cast<std::size_t>(j)]),
                                1e-10);
                }
            }
        }
    }
}

TEST(LeastSquares, PerPairSetsUseTheirOffsetsOnly) {
    const int d = 3;
    const Image image = test::mixed_texture({28, 33}, d, 9);
    const auto offsets = neighbourhood(3, NeighbourhoodKind::causal);
    std::vector<std::uint8_t> active(offsets.size() * d * d);
    for (std::size_t k = 0; k < active.size(); ++k) active[k] = k % 3 == 0 || k % 7 == 0 ? 1 : 0;
    for (std::size_t s = 0; s < offsets.size(); ++s) {
        for (std::size_t j = 0; j < d; ++j)
            active[(s * d + 2) * d + j] = 0;  // plane 3 has no neighbour at all
    }
    const LagCovariance statistic = lag_covariance(image, difference_box(offsets));
    const CarModel car =
        fit_car(statistic, {NeighbourhoodKind::causal, offsets, active}, NoiseForm::diagonal, no_prior());
    const SarModel sar =
        fit_sar(statistic, {NeighbourhoodKind::causal, offsets, active}, NoiseForm::diagonal);
    EXPECT_EQ(car.active, active);
    // A model is a support: its own fits it again.
    const SarModel again = fit_sar(statistic, sar, NoiseForm::diagonal);
    EXPECT_EQ(again.kind, NeighbourhoodKind::causal);
    EXPECT_EQ(again.offsets, sar.offsets);
    EXPECT_EQ(again.active, sar.active);
    EXPECT_EQ(again.coefficients, sar.coefficients);
    const auto e = errors(car, image);
    const double pixels = static_cast<double>(area(image.size()));
    for (int i = 0; i < d; ++i) {
        for (std::size_t s = 0; s < offsets.size(); ++s) {
            for (int j = 0; j < d; ++j) {
                const std::size_t k = (s * d + static_cast<std::size_t>(i)) * d + static_cast<std::size_t>(j);
                EXPECT_NEAR(sar.coefficients[k], car.coefficients[k], 1e-12);
                if (active[k] == 0) {
                    EXPECT_EQ(car.coefficients[k], 0.0);
                } else {
                    EXPECT_NEAR(correlation(e[static_cast<std::size_t>(i)], image, j, offsets[s]), 0.0,
                                1e-10);
                }
            }
        }
        const auto& own = e[static_cast<std::size_t>(i)];
        EXPECT_NEAR(reference::noise(car, i, i), mean_product(own, own) * pixels / (pixels + 2.0), 1e-10);
        for (int j = 0; j < d; ++j) {
            if (i != j) {
                EXPECT_EQ(reference::noise(car, i, j), 0.0);
            }
        }
    }
}

TEST(LeastSquares, SymmetricSinglePlanesHaveEqualOppositeCoefficients) {
    const Image image = test::mixed_texture({32, 32}, 1, 6);
    const auto offsets = neighbourhood(5, NeighbourhoodKind::symmetric);
    const SarModel model = fit_sar(lag_covariance(image, difference_box(offsets)),
                                   {NeighbourhoodKind::symmetric, offsets}, NoiseForm::full);
    for (std::size_t s = 0; s < offsets.size(); ++s) {
        EXPECT_EQ(model.coefficients[s], model.coefficients[offsets.size() - 1 - s]);
    }
}

TEST(LeastSquares, PlanesThatRepeatEachOther) {
    // A grey picture stored as RGB.
    const Image grey = test::mixed_texture({32, 32}, 1, 8);
    Image image({32, 32}, 3);
    for (int p = 0; p < 3; ++p) std::copy(grey.plane(0).begin(), grey.plane(0).end(), image.plane(p).begin());
    const auto offsets = neighbourhood(3, NeighbourhoodKind::causal);
    const LagCovariance statistic = lag_covariance(image, difference_box(offsets));
    const CarModel model = fit_car(statistic, {NeighbourhoodKind::causal, offsets}, NoiseForm::full);
    const Eigen::MatrixXd sigma = reference::noise_covariance(model);
    EXPECT_EQ(sigma.llt().info(), Eigen::Success);
    const CarModel single = fit_car(lag_covariance(grey, difference_box(offsets)),
                                    {NeighbourhoodKind::causal, offsets}, NoiseForm::full);
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j)
            EXPECT_NEAR(sigma(i, j), single.noise_covariance[0], 1e-5 * single.noise_covariance[0]);
    }
    for (std::size_t s = 0; s < offsets.size(); ++s) {
        for (int i = 0; i < 3; ++i) {
            double sum = 0.0;
            for (int j = 0; j < 3; ++j) sum += reference::coefficient(model, s, i, j);
            EXPECT_NEAR(sum, single.coefficients[s], 1e-5);  // strength / M = 1e-6, condition about ten
        }
    }
    EXPECT_TRUE(certify(model, statistic).valid);
    EXPECT_THROW((void)fit_sar(statistic, {NeighbourhoodKind::causal, offsets}, NoiseForm::full), InputError);
}

TEST(LeastSquares, RefusesWhatCannotBeFitted) {
    const Image image = test::mixed_texture({20, 20}, 2, 3);
    const auto offsets = neighbourhood(1, NeighbourhoodKind::causal);
    const LagCovariance statistic = lag_covariance(image, difference_box(offsets));
    const auto car = [&](const std::vector<Offset>& support, const std::vector<std::uint8_t>& active = {},
                         BayesPrior prior = {}) {
        (void)fit_car(statistic, {NeighbourhoodKind::custom, support, active}, NoiseForm::full, prior);
    };
    EXPECT_NO_THROW(car(offsets));
    EXPECT_THROW(car({}), InputError);
    EXPECT_THROW(car({{0, 1}}), InputError);
    EXPECT_THROW(car({{0, -1}, {0, -1}}), InputError);
    EXPECT_THROW(car({{0, 0}}), InputError);
    EXPECT_THROW(car({{0, -5}}), InputError);  // the statistic's box is smaller
    EXPECT_THROW(car(offsets, {1, 0}), InputError);
    EXPECT_THROW(car(offsets, {}, {-1.0, 2.0}), InputError);
    EXPECT_THROW(car(offsets, {}, {0.0, 1.0}), InputError);
    EXPECT_THROW(car(offsets, {}, {std::nan(""), 2.0}), InputError);
    EXPECT_THROW((void)fit_car({}, {NeighbourhoodKind::causal, offsets}, NoiseForm::full), InputError);
    const LagCovariance constant(2, {20, 20}, {2, 2});
    EXPECT_THROW((void)fit_car(constant, {NeighbourhoodKind::causal, offsets}, NoiseForm::full), InputError);
}

}  // namespace
}  // namespace btfield
