#include "btfield/fit.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>
#include <string>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "btfield/theory.hpp"
#include "host/spectral_density.hpp"
#include "tests/device_cases.hpp"
#include "tests/reference/fields.hpp"

namespace btfield {
namespace {

const std::filesystem::path pictures = BTFIELD_TEST_DATA;

Device& device() {
    return test::default_device();
}

/// White noise, smoothed along both axes and mixed between planes.
Image texture(Size size, int planes, unsigned seed) {
    std::mt19937 engine(seed);
    std::normal_distribution<float> normal;
    Image white(size, planes), image(size, planes);
    for (float& value : white.values()) value = normal(engine);
    for (int p = 0; p < planes; ++p) {
        for (int r = 0; r < size.height; ++r) {
            for (int c = 0; c < size.width; ++c) {
                const int below = (r + 1) % size.height, right = (c + 1) % size.width;
                image.at(p, r, c) = 0.5F + white.at(p, r, c) + 0.7F * white.at(p, below, c) +
                                    0.4F * white.at(p, r, right) + 0.5F * white.at((p + 1) % planes, r, c);
            }
        }
    }
    return image;
}

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

TEST(Fit, ExactCovariancesGiveTheCoefficientsBack) {
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
                const CarModel model = fit_car(exact, kind, offsets, {}, NoiseForm::full, no_prior());
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

TEST(Fit, PriorHasItsClosedForm) {
    // One plane, one offset: a = C(s) / (C(0) (1 + strength / M)), Σ = M (C(0) − 2 a C(s) + a² C(0) (1 +
    // strength / M)) / (M + β(0)).
    LagCovariance statistic(1, {10, 20}, {0, 1});
    statistic.set(0, 0, {0, 0}, 2.0);
    statistic.set(0, 0, {0, 1}, 1.2);
    for (const double strength : {0.0, 1e-3, 1.0, 50.0, 1e4}) {
        for (const double beta0 : {1.5, 40.0}) {
            const CarModel model = fit_car(statistic, NeighbourhoodKind::custom, {{0, -1}}, {},
                                           NoiseForm::full, {strength, beta0});
            const double ridge = 1.0 + strength / 200.0, a = 0.6 / ridge;
            EXPECT_NEAR(model.coefficients.at(0), a, 1e-14);
            EXPECT_NEAR(model.noise_covariance.at(0),
                        200.0 / (200.0 + beta0) * (2.0 - 2.0 * a * 1.2 + a * a * 2.0 * ridge), 1e-13);
        }
    }
}

TEST(Fit, PriorGoesFromLeastSquaresToWhiteNoise) {
    const Image image = texture({40, 36}, 2, 1);
    const auto offsets = neighbourhood(2, NeighbourhoodKind::causal);
    const LagCovariance statistic = lag_covariance(image, difference_box(offsets));
    const auto fitted = [&](double strength) {
        return fit_car(statistic, NeighbourhoodKind::causal, offsets, {}, NoiseForm::full, {strength, 2.0});
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

TEST(Fit, UnitsOfPlanesDoNotMatter) {
    Image image = texture({30, 34}, 2, 4);
    const auto offsets = neighbourhood(3, NeighbourhoodKind::causal);
    const auto fitted = [&] {
        return fit_car(lag_covariance(image, difference_box(offsets)), NeighbourhoodKind::causal, offsets, {},
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

TEST(Fit, SarErrorsAreOrthogonalToTheirNeighbours) {
    for (const int d : {1, 3}) {
        const Image image = texture({31, 26}, d, 2);
        for (const NeighbourhoodKind kind : {NeighbourhoodKind::symmetric, NeighbourhoodKind::half}) {
            const auto offsets = neighbourhood(2, kind);
            const SarModel model =
                fit_sar(lag_covariance(image, difference_box(offsets)), kind, offsets, {}, NoiseForm::full);
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

TEST(Fit, PerPairSetsUseTheirOffsetsOnly) {
    const int d = 3;
    const Image image = texture({28, 33}, d, 9);
    const auto offsets = neighbourhood(3, NeighbourhoodKind::causal);
    std::vector<std::uint8_t> active(offsets.size() * d * d);
    for (std::size_t k = 0; k < active.size(); ++k) active[k] = k % 3 == 0 || k % 7 == 0 ? 1 : 0;
    for (std::size_t s = 0; s < offsets.size(); ++s) {
        for (std::size_t j = 0; j < d; ++j)
            active[(s * d + 2) * d + j] = 0;  // plane 3 has no neighbour at all
    }
    const LagCovariance statistic = lag_covariance(image, difference_box(offsets));
    const CarModel car =
        fit_car(statistic, NeighbourhoodKind::causal, offsets, active, NoiseForm::diagonal, no_prior());
    const SarModel sar = fit_sar(statistic, NeighbourhoodKind::causal, offsets, active, NoiseForm::diagonal);
    EXPECT_EQ(car.active, active);
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

TEST(Fit, SymmetricSinglePlanesHaveEqualOppositeCoefficients) {
    const Image image = texture({32, 32}, 1, 6);
    const auto offsets = neighbourhood(5, NeighbourhoodKind::symmetric);
    const SarModel model = fit_sar(lag_covariance(image, difference_box(offsets)),
                                   NeighbourhoodKind::symmetric, offsets, {}, NoiseForm::full);
    for (std::size_t s = 0; s < offsets.size(); ++s) {
        EXPECT_EQ(model.coefficients[s], model.coefficients[offsets.size() - 1 - s]);
    }
}

TEST(Fit, PlanesThatRepeatEachOther) {
    // A grey picture stored as RGB.
    const Image grey = texture({32, 32}, 1, 8);
    Image image({32, 32}, 3);
    for (int p = 0; p < 3; ++p) std::copy(grey.plane(0).begin(), grey.plane(0).end(), image.plane(p).begin());
    const auto offsets = neighbourhood(3, NeighbourhoodKind::causal);
    const LagCovariance statistic = lag_covariance(image, difference_box(offsets));
    const CarModel model = fit_car(statistic, NeighbourhoodKind::causal, offsets, {}, NoiseForm::full);
    Eigen::Matrix3d sigma;
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) sigma(i, j) = reference::noise(model, i, j);
    }
    EXPECT_EQ(sigma.llt().info(), Eigen::Success);
    const CarModel single = fit_car(lag_covariance(grey, difference_box(offsets)), NeighbourhoodKind::causal,
                                    offsets, {}, NoiseForm::full);
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
    EXPECT_THROW((void)fit_sar(statistic, NeighbourhoodKind::causal, offsets, {}, NoiseForm::full),
                 InputError);
}

TEST(Fit, RefusesWhatCannotBeFitted) {
    const Image image = texture({20, 20}, 2, 3);
    const auto offsets = neighbourhood(1, NeighbourhoodKind::causal);
    const LagCovariance statistic = lag_covariance(image, difference_box(offsets));
    const auto car = [&](const std::vector<Offset>& support, const std::vector<std::uint8_t>& active = {},
                         BayesPrior prior = {}) {
        (void)fit_car(statistic, NeighbourhoodKind::custom, support, active, NoiseForm::full, prior);
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
    EXPECT_THROW((void)fit_car({}, NeighbourhoodKind::causal, offsets, {}, NoiseForm::full), InputError);
    const LagCovariance constant(2, {20, 20}, {2, 2});
    EXPECT_THROW((void)fit_car(constant, NeighbourhoodKind::causal, offsets, {}, NoiseForm::full),
                 InputError);
}

std::string message(const Image& image, const FitOptions& options) {
    try {
        (void)fit(device(), image, options);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

TEST(Fit, SaysHowManyLevelsFit) {
    FitOptions options;
    options.order = 5;
    options.levels = 5;  // 40, 20, 10, 5, 3: order 5 spans 3 rows and 5 columns and has 12 offsets
    EXPECT_NE(message(texture({40, 40}, 1, 1), options).find("at most 4 levels"), std::string::npos);
    EXPECT_NE(message(texture({40, 40}, 3, 1), options).find("at most 3 levels"),
              std::string::npos);  // 25 pixels, 36 unknowns
    options.levels = 1;
    EXPECT_NE(message(texture({4, 4}, 1, 1), options).find("larger picture"), std::string::npos);
    options.levels = -1;
    EXPECT_NE(message(texture({40, 40}, 1, 1), options), "");
}

TEST(Fit, RefusesConstantPlanesAndUndefinedPixels) {
    FitOptions options;
    options.levels = 1;
    options.marginals = MarginalMode::none;
    Image image = texture({40, 40}, 2, 1);
    std::fill(image.plane(1).begin(), image.plane(1).end(), 0.25F);
    EXPECT_NE(message(image, options).find("plane 2 is constant"), std::string::npos);
    image = texture({40, 40}, 2, 1);
    image.at(0, 3, 3) = std::nanf("");
    EXPECT_NE(message(image, options).find("plane 1"), std::string::npos);
    EXPECT_NE(message(Image{}, options), "");
    options.neighbourhood = NeighbourhoodKind::symmetric;
    EXPECT_NE(message(texture({40, 40}, 2, 1), options).find("raster order"), std::string::npos);
}

TEST(Fit, LevelsOfTheDefault) {
    EXPECT_EQ(default_levels({8, 8}), 1);
    EXPECT_EQ(default_levels({63, 500}), 1);
    EXPECT_EQ(default_levels({64, 64}), 2);
    EXPECT_EQ(default_levels({128, 300}), 3);
    EXPECT_EQ(default_levels({256, 256}), 4);
    EXPECT_EQ(default_levels({511, 600}), 4);
    EXPECT_EQ(default_levels({512, 512}), 5);
    EXPECT_EQ(default_levels({4096, 4096}), 5);
    EXPECT_EQ(default_levels({300, 300}, 3), 3);
    // Six planes and 12 offsets: 72 unknowns ask for 1440 pixels, 38 a side.
    EXPECT_EQ(fit(device(), texture({64, 70}, 6, 1)).levels.size(), 1U);
    EXPECT_EQ(fit(device(), texture({64, 70}, 1, 1)).levels.size(), 2U);
}

TEST(Fit, RepeatsBitForBitAndReportsItsStages) {
    const Image image = texture({50, 61}, 3, 12);
    FitOptions options;
    options.levels = 3;
    options.order = 2;
    std::string stages;
    options.progress = [&](std::string_view stage, double seconds) {
        EXPECT_GE(seconds, 0.0);
        stages += std::string(stage) + ";";
    };
    const TextureModel first = fit(device(), image, options), second = fit(device(), image, options);
    const std::string level = "lag covariances;fit;";
    const std::string once = "planes;pyramid;" + level + level + level + "gains;";
    EXPECT_EQ(stages, once + once);
    ASSERT_EQ(first.levels.size(), 3U);
    for (std::size_t k = 0; k < 3; ++k) {
        const LevelModel &a = first.levels[k], &b = second.levels[k];
        EXPECT_EQ(linear_field(a.models.front()).coefficients, linear_field(b.models.front()).coefficients);
        EXPECT_EQ(linear_field(a.models.front()).noise_covariance,
                  linear_field(b.models.front()).noise_covariance);
        EXPECT_EQ(a.gain, b.gain);
        EXPECT_EQ(a.certificate.min_singular, b.certificate.min_singular);
        EXPECT_EQ(a.log_likelihood, b.log_likelihood);
    }
    EXPECT_EQ(first.levels[2].size, (Size{13, 16}));
    for (int p = 0; p < 3; ++p)
        EXPECT_NEAR(first.mean.at(static_cast<std::size_t>(p)), reference::mean(image, p), 1e-14);
    check(first);
}

TEST(Fit, LikelihoodIsTheGaussianOneOnTheTorus) {
    // Small enough for the exact density of the stacked vector: −½ (N ln 2π + ln det Σ_Y + yᵀ Σ_Y⁻¹ y) /
    // pixels.
    const Size size{14, 16};
    const Image image = texture(size, 2, 21);
    FitOptions options;
    options.levels = 1;
    options.order = 1;
    for (const ModelKind kind : {ModelKind::car3d, ModelKind::msar3d}) {
        options.model = kind;
        options.marginals = MarginalMode::none;
        options.neighbourhood =
            kind == ModelKind::car3d ? NeighbourhoodKind::causal : NeighbourhoodKind::half;
        const TextureModel model = fit(device(), image, options);
        ASSERT_TRUE(is_valid(model));
        const Eigen::MatrixXd covariance =
            reference::field_covariance(linear_field(model.levels[0].models.front()), size);
        Eigen::VectorXd y(covariance.rows());
        for (int i = 0; i < 2; ++i) {
            for (int r = 0; r < size.height; ++r) {
                for (int c = 0; c < size.width; ++c) {
                    y[reference::place(size, i, r, c)] =
                        static_cast<double>(image.at(i, r, c)) - reference::mean(image, i);
                }
            }
        }
        const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
        const Eigen::MatrixXd lower = factor.matrixL();
        const double log_determinant = 2.0 * lower.diagonal().array().log().sum();
        const double exact = -0.5 *
                             (static_cast<double>(y.size()) * std::log(2.0 * std::numbers::pi) +
                              log_determinant + y.dot(factor.solve(y))) /
                             static_cast<double>(area(size));
        // The log-determinant is the infinite lattice's, not that of 14 × 16: the difference falls like the
        // response to noise around the torus, here at most 0.5^14 = 6e-5.
        EXPECT_NEAR(model.levels[0].log_likelihood, exact, 1e-4);
    }
}

TEST(Fit, SymmetricLeastSquaresFailsItsCertificateOnARealPicture) {
    const Image image = read_picture(pictures / "cork.png").image;
    FitOptions options;
    options.levels = 3;
    options.order = 3;
    options.model = ModelKind::msar3d;
    options.estimator = EstimatorChoice::least_squares;
    options.neighbourhood = NeighbourhoodKind::symmetric;
    const TextureModel sar = fit(device(), image, options);
    EXPECT_FALSE(is_valid(sar));
    for (const LevelModel& level : sar.levels) {
        EXPECT_EQ(level.gain, 1.0);
        if (!level.certificate.valid) {
            EXPECT_TRUE(std::isnan(level.log_likelihood));
            EXPECT_GT(level.certificate.variance_ratio[0], 10.0);
        }
    }
    options.model = ModelKind::car3d;
    options.neighbourhood = NeighbourhoodKind::causal;
    EXPECT_TRUE(is_valid(fit(device(), image, options)));
}

TEST(Fit, UnstableCausalLeastSquaresGivesWayToLikelihood) {
    FitOptions options;
    options.model = ModelKind::car2d;
    options.levels = 2;
    options.order = 3;
    // 64 x 64 pixels at the coarse level, few for their long correlations.
    const Image image = read_picture(pictures / "cork.png").image.crop(0, 0, {128, 128});
    options.estimator = EstimatorChoice::least_squares;
    const TextureModel unstable = fit(device(), image, options);
    ASSERT_FALSE(unstable.levels[1].certificate.valid);
    for (const EstimatorChoice choice : {EstimatorChoice::automatic, EstimatorChoice::maximum_likelihood}) {
        options.estimator = choice;
        const TextureModel model = fit(device(), image, options);
        EXPECT_TRUE(is_valid(model));
        EXPECT_EQ(model.levels[0].estimator, Estimator::least_squares);
        EXPECT_EQ(model.levels[1].estimator, Estimator::maximum_likelihood);
        EXPECT_TRUE(std::holds_alternative<CarModel>(model.levels[1].models[0]));
        for (const double ratio : model.levels[1].certificate.variance_ratio) {
            EXPECT_GT(ratio, 0.5);
            EXPECT_LT(ratio, 2.0);
        }
    }
}

struct Promise {
    const char* file;
    double covariance, deviation;
};

class RealPictures : public testing::TestWithParam<Promise> {};

TEST_P(RealPictures, DefaultsPromiseTheCovariancesOfThePicture) {
    const Image image = read_picture(pictures / GetParam().file).image;
    const TextureModel model = fit(device(), image);
    EXPECT_TRUE(is_valid(model));
    const std::vector<Offset> lags = probe_lags(image.size());
    const std::vector<double> data = covariances_at(image, lags);
    const std::vector<double> theory = theoretical_covariance(model, image.size(), lags);
    const auto d = static_cast<std::size_t>(image.planes());
    double error = 0.0;
    for (std::size_t i = 0; i < d; ++i) {
        for (std::size_t s = 0; s < lags.size(); ++s) {
            error += std::abs(theory[(s * d + i) * d + i] - data[(s * d + i) * d + i]) / data[i * d + i];
        }
        EXPECT_NEAR(std::sqrt(theory[i * d + i] / data[i * d + i]), 1.0, GetParam().deviation)
            << "plane " << i;
    }
    EXPECT_LE(error / static_cast<double>(d * lags.size()), GetParam().covariance);
}

// What the project promises of textures, 0.05 each, holds for the model already.
INSTANTIATE_TEST_SUITE_P(Fit, RealPictures,
                         testing::Values(Promise{"cork.png", 0.05, 0.05}, Promise{"bark.png", 0.05, 0.05},
                                         Promise{"rock.png", 0.05, 0.05}, Promise{"sand.png", 0.05, 0.05},
                                         Promise{"grass.png", 0.05, 0.05},
                                         Promise{"cork-xyz.exr", 0.05, 0.05},
                                         Promise{"landsat.tif", 0.05, 0.05}),
                         [](const auto& parameter) {
                             std::string name = parameter.param.file;
                             return name.substr(0, name.find_first_of(".-")) +
                                    (name.ends_with("exr") ? "Xyz" : "");
                         });

}  // namespace
}  // namespace btfield
