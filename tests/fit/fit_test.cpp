#include "btfield/fit.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "btfield/synthesis.hpp"
#include "btfield/theory.hpp"
#include "tests/device_cases.hpp"
#include "tests/places.hpp"
#include "tests/reference/fields.hpp"

namespace btfield {
namespace {

const std::filesystem::path pictures = test::data_folder();

Device& device() {
    return test::default_device();
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
    EXPECT_NE(message(test::mixed_texture({40, 40}, 1, 1), options).find("at most 4 levels"),
              std::string::npos);
    EXPECT_NE(message(test::mixed_texture({40, 40}, 3, 1), options).find("at most 3 levels"),
              std::string::npos);  // 25 pixels, 36 unknowns
    options.levels = 1;
    EXPECT_NE(message(test::mixed_texture({4, 4}, 1, 1), options).find("larger picture"), std::string::npos);
    options.levels = -1;
    EXPECT_NE(message(test::mixed_texture({40, 40}, 1, 1), options), "");
}

/// Standard deviations of the planes.
std::vector<double> deviations(const Image& image) {
    std::vector<double> result;
    for (int p = 0; p < image.planes(); ++p) {
        double sum = 0.0, squares = 0.0;
        for (const float v : image.plane(p)) sum += static_cast<double>(v);
        sum /= static_cast<double>(area(image.size()));
        for (const float v : image.plane(p)) squares += std::pow(static_cast<double>(v) - sum, 2.0);
        result.push_back(std::sqrt(squares / static_cast<double>(area(image.size()))));
    }
    return result;
}

TEST(Fit, GivesConstantPlanesBack) {
    for (const ColourSpace space : {ColourSpace::srgb, ColourSpace::unspecified}) {
        Image image = test::mixed_texture({64, 64}, 3, 1);
        image.set_space(space);
        std::fill(image.plane(1).begin(), image.plane(1).end(), 0.25F);
        for (const ModelKind kind : {ModelKind::car3d, ModelKind::msar2d, ModelKind::mmrf3d})
            for (const MarginalMode marginals : {MarginalMode::match, MarginalMode::none}) {
                FitOptions options;
                options.model = kind;
                options.marginals = marginals;
                options.levels = 1;
                if (kind != ModelKind::car3d) options.neighbourhood = NeighbourhoodKind::symmetric;
                const TextureModel model = fit(device(), image, options);
                EXPECT_EQ(model.planes, 3);
                EXPECT_EQ(modelled_planes(model), 2);
                const Image texture = Synthesiser(device(), model, {96, 96}).synthesise(1);
                for (const float v : texture.plane(1)) ASSERT_EQ(v, 0.25F);
                const std::vector<double> own = deviations(texture), picture = deviations(image);
                EXPECT_NEAR(own[0] / picture[0], 1.0, 0.15) << name(kind) << ' ' << name(marginals);
                EXPECT_NEAR(own[2] / picture[2], 1.0, 0.15) << name(kind) << ' ' << name(marginals);
            }
    }
}

TEST(Fit, UnitsOfPlanesChangeNothing) {
    const Image image = test::mixed_texture({64, 64}, 4, 1);
    const std::array units{1.0F, 1e-5F, 2.1e4F, 634.0F};
    Image other = image;
    for (int p = 0; p < 4; ++p)
        for (float& v : other.plane(p))
            v = v * units[static_cast<std::size_t>(p)] + 3.0F * units[static_cast<std::size_t>(p)];
    for (const ModelKind kind : {ModelKind::car3d, ModelKind::car2d, ModelKind::pmrf3d})
        for (const MarginalMode marginals : {MarginalMode::match, MarginalMode::none}) {
            FitOptions options;
            options.model = kind;
            options.marginals = marginals;
            options.levels = 2;
            if (kind == ModelKind::pmrf3d) options.neighbourhood = NeighbourhoodKind::symmetric;
            const TextureModel a = fit(device(), image, options), b = fit(device(), other, options);
            EXPECT_EQ(a.basis.scale.size(), 4U);
            const Image x = Synthesiser(device(), a, {64, 64}).synthesise(1);
            const Image y = Synthesiser(device(), b, {64, 64}).synthesise(1);
            const std::vector<double> deviation = deviations(x);
            for (int p = 0; p < 4; ++p) {
                const auto q = static_cast<std::size_t>(p);
                double worst = 0.0;
                for (std::size_t n = 0; n < area(x.size()); ++n)
                    worst = std::max(worst, std::abs(static_cast<double>(y.plane(p)[n] / units[q] - 3.0F -
                                                                         x.plane(p)[n])));
                EXPECT_LT(worst, 2e-3 * deviation[q])
                    << name(kind) << ' ' << name(marginals) << " plane " << p;
            }
        }
}

TEST(Fit, RefusesConstantPicturesAndUndefinedPixels) {
    FitOptions options;
    options.levels = 1;
    options.marginals = MarginalMode::none;
    Image image = test::mixed_texture({40, 40}, 2, 1);
    for (int p = 0; p < 2; ++p) std::fill(image.plane(p).begin(), image.plane(p).end(), 0.25F);
    EXPECT_NE(message(image, options).find("all its pixels are equal"), std::string::npos);
    image = test::mixed_texture({40, 40}, 2, 1);
    image.at(0, 3, 3) = std::nanf("");
    EXPECT_NE(message(image, options).find("plane 1"), std::string::npos);
    EXPECT_NE(message(Image{}, options), "");
    options.neighbourhood = NeighbourhoodKind::symmetric;
    EXPECT_NE(message(test::mixed_texture({40, 40}, 2, 1), options).find("raster order"), std::string::npos);
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
    EXPECT_EQ(fit(device(), test::mixed_texture({64, 70}, 6, 1)).levels.size(), 1U);
    EXPECT_EQ(fit(device(), test::mixed_texture({64, 70}, 1, 1)).levels.size(), 2U);
}

TEST(Fit, RepeatsBitForBitAndReportsItsStages) {
    const Image image = test::mixed_texture({50, 61}, 3, 12);
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
    Image image = test::mixed_texture(size, 2, 21);
    image.set_space(ColourSpace::linear);  // planes of one kind are modelled in their own units
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

TEST(FitLong, LikelihoodCertifiesLevelsOfFewPixels) {
    // 16 x 16 pixels at the coarsest level, 768 values for 222 unknowns: det Λ has zeros wherever a descent
    // ends that is free to go anywhere.
    const Image image = read_picture(pictures / "cork-xyz.exr").image;
    FitOptions options;
    options.model = ModelKind::msar3d;
    options.estimator = EstimatorChoice::maximum_likelihood;
    options.levels = 4;
    options.order = 5;
    options.marginals = MarginalMode::none;
    const TextureModel model = fit(device(), image, options);
    for (const LevelModel& level : model.levels) {
        EXPECT_TRUE(level.certificate.valid) << level.size.height;
        EXPECT_EQ(level.certificate.zeros, 0);
        EXPECT_TRUE(std::isfinite(level.log_likelihood));
        for (const double ratio : level.certificate.variance_ratio) {
            EXPECT_GT(ratio, 0.5);
            EXPECT_LT(ratio, 2.0);
        }
    }
}

TEST(Fit, LikelihoodCertifiesSmoothLevelsOfPlanesThatRepeat) {
    const Image image = read_picture(pictures / "rock.png").image;
    FitOptions options;
    options.model = ModelKind::pmrf3d;
    options.estimator = EstimatorChoice::maximum_likelihood;
    options.marginals = MarginalMode::none;
    options.order = 1;
    for (const int levels : {2, 3}) {
        options.levels = levels;
        const TextureModel model = fit(device(), image, options);
        EXPECT_TRUE(is_valid(model));
        for (const LevelModel& level : model.levels) {
            for (const double ratio : level.certificate.variance_ratio) EXPECT_LE(ratio, 1.05);
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
