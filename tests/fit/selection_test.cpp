#include "host/fit/selection.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <complex>
#include <filesystem>
#include <numbers>
#include <random>
#include <string>

#include "btfield/error.hpp"
#include "btfield/fit.hpp"
#include "btfield/image_io.hpp"
#include "btfield/pyramid.hpp"
#include "btfield/synthesis.hpp"
#include "host/fit/correlated_support.hpp"
#include "host/fit/model_density.hpp"
#include "host/spectrum/theory.hpp"
#include "tests/device_cases.hpp"
#include "tests/example_model.hpp"
#include "tests/linear_field_cases.hpp"
#include "tests/places.hpp"
#include "tests/reference/algebra.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

Device& device() {
    return test::default_device();
}

/// Levels of one family on a pyramid of this picture.
TextureModel model_of_levels(ModelKind kind, Size size, const std::vector<LinearField>& fields) {
    TextureModel model;
    model.kind = kind;
    model.size = size;
    model.planes = fields.front().planes;
    model.mean.assign(static_cast<size_t>(model.planes), 0.0);
    const std::vector<Size> sizes = pyramid_sizes(size, static_cast<int>(fields.size()), model.factor);
    for (size_t k = 0; k < fields.size(); ++k) {
        LevelModel level;
        level.size = sizes[k];
        level.models = {model_of(family(kind), fields[k])};
        level.certificate.valid = true;
        level.certificate.variance_ratio.assign(static_cast<size_t>(model.planes), 1.0);
        model.levels.push_back(level);
    }
    return model;
}

LinearField field_of(NeighbourhoodKind kind, int order, int planes, double sum, unsigned seed) {
    LinearField field = test::random_field(neighbourhood(order, kind), planes, sum, true, seed);
    field.kind = kind;
    return field;
}

Image grown(ModelKind kind, const std::vector<LinearField>& fields, Size size, std::uint64_t seed = 7) {
    return Synthesiser(device(), model_of_levels(kind, size, fields), size).synthesise(seed);
}

/// Values as they are, no pyramid.
FitOptions plain(ModelKind kind) {
    FitOptions options;
    options.model = kind;
    options.levels = 1;
    options.marginals = MarginalMode::none;
    return options;
}

size_t offsets_of(const TextureModel& model) {
    return linear_field(model.levels.front().models.front()).offsets.size();
}

std::string reasons_of(const TextureModel& model) {
    std::string text;
    for (const std::string& reason : model.provenance.reasons) text += reason + "\n";
    return text;
}

// A coefficient that is left out costs about N a² / σ² of −2 log L, here N = 65 536 and the outermost ring's
// Σ a² is at least 1e-2; a superfluous parameter gains 1 and is charged ln N = 11.
TEST(Selection, BicFindsTheOrderOfAKnownModel) {
    for (const int order : {1, 3, 5}) {
        for (const int planes : {1, 2}) {
            const LinearField field = field_of(NeighbourhoodKind::causal, order, planes, 0.8, 3);
            const Image image = grown(ModelKind::car3d, {field}, {256, 256});
            FitOptions options = plain(ModelKind::car3d);
            options.order = 0;
            const TextureModel model = fit(device(), image, options);
            EXPECT_EQ(offsets_of(model), field.offsets.size()) << "order " << order << "\n"
                                                               << reasons_of(model);
            ASSERT_EQ(model.provenance.reasons.size(), 1U);
            const std::string& reason = model.provenance.reasons.front();
            EXPECT_EQ(reason.rfind("order " + std::to_string(order) + ": BIC ", 0), 0U) << reason;
            EXPECT_NE(reason.find(" against "), std::string::npos) << reason;
            // What is said is what is: the reason's number is the model's own.
            EXPECT_NEAR(std::stod(reason.substr(reason.find("BIC ") + 4)), level_bic(model), 0.5) << reason;
        }
    }
    const LinearField ring = field_of(NeighbourhoodKind::symmetric, 2, 1, 0.8, 4);
    FitOptions options = plain(ModelKind::msar3d);
    options.order = 0;
    options.estimator = EstimatorChoice::maximum_likelihood;
    const TextureModel model = fit(device(), grown(ModelKind::msar3d, {ring}, {192, 192}), options);
    EXPECT_EQ(offsets_of(model), 8U) << reasons_of(model);
}

TEST(Selection, BicCountsPixelsAndParametersOfEveryLevel) {
    TextureModel model = model_of_levels(ModelKind::mmrf3d, {20, 10},
                                         {field_of(NeighbourhoodKind::symmetric, 2, 2, 0.5, 1),
                                          field_of(NeighbourhoodKind::symmetric, 1, 2, 0.5, 2)});
    model.levels[0].log_likelihood = -1.5;
    model.levels[1].log_likelihood = 0.25;
    // 8 and 4 offsets of 2 x 2 coefficients, halves free; 3 entries of Σ.
    const double expected =
        2.0 * 200.0 * 1.5 + 19.0 * std::log(200.0) - 2.0 * 50.0 * 0.25 + 11.0 * std::log(50.0);
    EXPECT_NEAR(level_bic(model), expected, 1e-12 * expected);
    model.levels[1].log_likelihood = std::nan("");
    EXPECT_TRUE(std::isnan(level_bic(model)));
}

// The density at full resolution, by the covariances of the same model: their transform on the picture's
// torus is S_t exactly, as the sides are multiples of 2^(K − 1) and cells this near 0 are single frequencies.
TEST(Selection, PictureLikelihoodIsThatOfTheModelsCovariances) {
    const Size size{16, 24};
    for (const ModelKind kind : {ModelKind::car3d, ModelKind::ma3d, ModelKind::mmrf3d, ModelKind::pmrf3d}) {
        const int planes = 2;
        LinearField field = test::example_field(kind, planes, NoiseForm::diagonal, false, 1);
        TextureModel model = model_of_levels(kind, size, {field, field, field});
        model.levels[0].gain = 0.7;
        model.levels[2].gain = 1.4;
        std::mt19937 engine(5);
        std::normal_distribution<float> normal;
        Image image(size, planes);
        for (float& value : image.values()) value = 0.1F * normal(engine);

        std::vector<Offset> lags;
        for (int row = 0; row < size.height; ++row) {
            for (int column = 0; column < size.width; ++column) lags.push_back({row, column});
        }
        const std::vector<double> covariance = modelled_covariance(model, size, lags);
        const std::vector<double> data = covariances_at(image, lags);
        double sum = 0.0;
        for (const Offset t : lags) {
            if (t == Offset{}) continue;
            Eigen::MatrixXcd density = Eigen::MatrixXcd::Zero(planes, planes), seen = density;
            for (size_t s = 0; s < lags.size(); ++s) {
                const double angle = 2.0 * std::numbers::pi *
                                     (static_cast<double>(t.row * lags[s].row) / size.height +
                                      static_cast<double>(t.column * lags[s].column) / size.width);
                for (int i = 0; i < planes; ++i) {
                    for (int j = 0; j < planes; ++j) {
                        const size_t place = s * 4 + static_cast<size_t>(2 * i + j);
                        density(i, j) += covariance[place] * std::polar(1.0, angle);
                        seen(i, j) += data[place] * std::polar(1.0, angle);
                    }
                }
            }
            sum += planes * std::log(2.0 * std::numbers::pi) + std::log(density.determinant().real()) +
                   reference::product(reference::inverse(density), seen).trace().real();
        }
        const double expected = -0.5 * sum / static_cast<double>(area(size));
        // Single precision of the picture does not enter: both see the same values. Sums of 384 terms in
        // float64, conditions of S below 1e4.
        EXPECT_NEAR(picture_log_likelihood(model, folded_periodogram(image)), expected,
                    1e-9 * std::abs(expected))
            << name(kind);
    }
}

TEST(Selection, LevelsFollowTheScalesOfThePicture) {
    // Fine grain on slow waves: no support of order 2 at full resolution reaches from one to the other.
    LinearField grain = field_of(NeighbourhoodKind::causal, 1, 1, 0.1, 1);
    grain.noise_covariance = {0.01};
    LinearField waves = grain;
    waves.offsets = {{-1, 0}, {0, -1}};
    waves.coefficients = {0.4, 0.4};
    waves.noise_covariance = {0.02};
    const Size size{256, 256};
    FitOptions options = plain(ModelKind::car3d);
    options.order = 2;
    options.levels = 0;
    options.choose_levels = true;
    const TextureModel scales =
        fit(device(), grown(ModelKind::car3d, {grain, grain, grain, waves}, size), options);
    EXPECT_GE(scales.levels.size(), 3U) << reasons_of(scales);
    ASSERT_EQ(scales.provenance.reasons.size(), 1U);
    EXPECT_EQ(
        scales.provenance.reasons.front().rfind(std::to_string(scales.levels.size()) + " levels: BIC ", 0),
        0U)
        << scales.provenance.reasons.front();

    const TextureModel single = fit(device(), grown(ModelKind::car3d, {grain}, size), options);
    EXPECT_EQ(single.levels.size(), 1U) << reasons_of(single);

    options.levels = 2;  // the most
    EXPECT_LE(
        fit(device(), grown(ModelKind::car3d, {grain, grain, grain, waves}, size), options).levels.size(),
        2U);
}

TEST(Selection, KappaChoosesDimensionsAndTheLikelihoodTheFamily) {
    const Size size{192, 192};
    const auto chosen = [&](ModelKind kind, LinearField field, double deviation) {
        for (double& value : field.noise_covariance) value *= deviation * deviation;
        FitOptions options = plain(ModelKind::car3d);
        options.choose_model = true;
        options.order = 2;
        return fit(device(), grown(kind, {std::move(field)}, size), options);
    };
    // Variances of (0.3 · 256)² = 5900: κ(256) > 1e3. Of (0.01 · 256)² = 6.6: κ(256) < 1e-4.
    const LinearField causal = field_of(NeighbourhoodKind::causal, 2, 3, 0.8, 8);
    const TextureModel loud = chosen(ModelKind::car3d, causal, 0.3);
    EXPECT_EQ(loud.kind, ModelKind::car3d) << reasons_of(loud);
    EXPECT_NE(reasons_of(loud).find("kappa(256) "), std::string::npos) << reasons_of(loud);
    EXPECT_NE(reasons_of(loud).find(" > 3: 3D; 3d-car: BIC "), std::string::npos) << reasons_of(loud);
    const TextureModel faint = chosen(ModelKind::car3d, causal, 0.01);
    EXPECT_TRUE(is_2d(faint.kind)) << reasons_of(faint);
    EXPECT_NE(reasons_of(faint).find(" <= 3: 2D; "), std::string::npos) << reasons_of(faint);

    LinearField markov = field_of(NeighbourhoodKind::symmetric, 2, 1, 0.0, 1);
    for (size_t s = 0; s < markov.offsets.size(); ++s)
        markov.coefficients[s] = markov.offsets[s].row == 0 || markov.offsets[s].column == 0 ? 0.2 : 0.04;
    const TextureModel single = chosen(ModelKind::mmrf3d, markov, 0.01);
    EXPECT_EQ(single.kind, ModelKind::mmrf3d) << reasons_of(single);
    EXPECT_NE(reasons_of(single).find("one plane"), std::string::npos) << reasons_of(single);
}

TEST(Selection, MovingAveragesChooseByLikelihoodOrError) {
    const Image image =
        read_picture(std::filesystem::path(test::data_folder()) / "sand.png", Crop{0, 0, 128, 128}).image;
    FitOptions options;
    options.model = ModelKind::ma3d;
    options.order = 0;
    options.levels = 2;
    const TextureModel model = fit(device(), image, options);
    ASSERT_EQ(model.provenance.reasons.size(), 1U);
    const std::string& reason = model.provenance.reasons.front();
    EXPECT_TRUE(reason.find(": BIC ") != std::string::npos ||
                (reason.find(": lag covariance error ") != std::string::npos &&
                 reason.find("not every order has a likelihood") != std::string::npos))
        << reason;
    EXPECT_EQ(model.levels.size(), 2U);
}

/// Correlations that favour some offsets: 1 at 0, `strong` at those and −those, else falling with distance.
LagCovariance statistic_with(const std::vector<Offset>& strong, int planes) {
    LagCovariance statistic(planes, {64, 64}, {3, 3});
    for (int i = 0; i < planes; ++i) {
        const double variance = 1.0 + i;
        for (int row = -3; row <= 3; ++row) {
            for (int column = -3; column <= 3; ++column)
                statistic.set(i, i, {row, column}, variance * 0.1 / (1 + row * row + column * column));
        }
        for (const Offset s : strong) statistic.set(i, i, s, -0.5 * variance);
        statistic.set(i, i, {}, variance);
    }
    return statistic;
}

TEST(Selection, CorrelatedKeepsTheStrongestOffsets) {
    const std::vector<Offset> strong{{-3, -2}, {-2, 3}, {0, -3}};
    const LagCovariance statistic = statistic_with(strong, 2);
    const auto kept = [&](NeighbourhoodKind kind, int count) {
        return correlated_support(statistic, {kind, correlated_candidates(kind, count)}, count)
            .support.offsets;
    };
    EXPECT_EQ(kept(NeighbourhoodKind::causal, 3), strong);
    std::vector<Offset> both = strong;
    for (const Offset s : strong) both.push_back(-s);
    std::ranges::sort(both);
    EXPECT_EQ(kept(NeighbourhoodKind::symmetric, 6), both);
    // (−3, −2) and (0, −3) are all of the quarter plane's; next come the nearest.
    EXPECT_EQ(kept(NeighbourhoodKind::unilateral, 4),
              (std::vector<Offset>{{-3, -2}, {-1, 0}, {0, -3}, {0, -1}}));
    std::vector<Offset> positive;
    for (const Offset s : strong) positive.push_back(-s);
    std::ranges::sort(positive);
    EXPECT_EQ(kept(NeighbourhoodKind::half, 3), positive);
    // All of them: the neighbourhood itself.
    EXPECT_EQ(kept(NeighbourhoodKind::causal, 22), neighbourhood(8, NeighbourhoodKind::causal));
    const CorrelatedSupport weakest = correlated_support(
        statistic, {NeighbourhoodKind::causal, neighbourhood(8, NeighbourhoodKind::causal)}, 4);
    EXPECT_DOUBLE_EQ(weakest.weakest_kept, 0.05);  // 0.1 / (1 + 1), after three of 0.5
    EXPECT_EQ(weakest.support.kind, NeighbourhoodKind::custom);
}

TEST(Selection, CorrelatedFitsEveryFamily) {
    const Image image =
        read_picture(std::filesystem::path(test::data_folder()) / "sand.png", Crop{0, 0, 96, 96}).image;
    for (const ModelKind kind : {ModelKind::car3d, ModelKind::msar3d, ModelKind::mmrf2d, ModelKind::ma3d}) {
        FitOptions options;
        options.model = kind;
        options.correlated = 6;
        options.levels = 2;
        const TextureModel model = fit(device(), image, options);
        check(model);
        const bool average = family(kind) == Family::ma;
        for (const LevelModel& level : model.levels) {
            const LinearField& field = linear_field(level.models.front());
            EXPECT_EQ(field.kind, NeighbourhoodKind::custom);
            EXPECT_EQ(field.offsets.size(), average ? 7U : 6U);
            for (const Offset s : field.offsets) {
                if (family(kind) == Family::car) {
                    EXPECT_LT(s, Offset{});
                } else {
                    EXPECT_TRUE(std::ranges::binary_search(field.offsets, -s));
                }
            }
        }
        EXPECT_EQ(reasons_of(model).rfind("the 6 most correlated of ", 0), 0U) << reasons_of(model);
    }
}

TEST(Selection, RefusesWhatCannotBeChosen) {
    Image image(Size{32, 32}, 1);
    std::mt19937 engine(1);
    std::normal_distribution<float> normal;
    for (float& value : image.values()) value = normal(engine);
    const auto refused = [&](const std::function<void(FitOptions&)>& change, const std::string& part) {
        FitOptions options;
        change(options);
        try {
            static_cast<void>(fit(device(), image, options));
            ADD_FAILURE() << "no error with " << part;
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
        }
    };
    refused([](FitOptions& o) { o.correlated = 23; }, "22 causal offsets");
    refused([](FitOptions& o) { o.correlated = -1; }, "use 1 to 22");
    refused(
        [](FitOptions& o) {
            o.model = ModelKind::mmrf3d;
            o.correlated = 5;
        },
        "even number");
    refused(
        [](FitOptions& o) {
            o.correlated = 4;
            o.neighbourhood = NeighbourhoodKind::custom;
        },
        "custom");
    refused(
        [](FitOptions& o) {
            o.correlated = 4;
            o.order = 0;
        },
        "take the place of an order");
    refused(
        [](FitOptions& o) {
            o.order = 0;
            o.neighbourhood = NeighbourhoodKind::custom;
            o.offsets = {{0, -1}};
        },
        "custom neighbourhood has no order");
    refused(
        [](FitOptions& o) {
            o.choose_levels = true;
            o.levels = -2;
        },
        "at least one level");
    refused([](FitOptions& o) { o.order = -1; }, "orders run from 1 to 8");
    // What no candidate can be fitted to is the first one's error.
    for (float& value : image.values()) value = 0.5F;
    refused([](FitOptions& o) { o.choose_model = true; }, "all its pixels are equal");
}

}  // namespace
}  // namespace btfield
