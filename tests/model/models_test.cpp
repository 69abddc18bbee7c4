#include "btfield/models.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "tests/example_model.hpp"

namespace btfield {
namespace {

using test::example_model;
using test::field_of;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

/// The defect that check() names; empty when it accepts the model.
std::string defect(const TextureModel& model) {
    try {
        check(model);
    } catch (const InputError& error) {
        EXPECT_FALSE(error.asked().empty());
        EXPECT_FALSE(error.remedy().empty());
        return error.found().empty() ? "?" : error.found();
    }
    return {};
}

TEST(Models, NamesReadBack) {
    for (const ModelKind kind : {ModelKind::car3d, ModelKind::msar3d})
        EXPECT_EQ(model_kind(name(kind)), kind);
    for (const NoiseForm form : {NoiseForm::full, NoiseForm::diagonal})
        EXPECT_EQ(noise_form(name(form)), form);
    EXPECT_EQ(name(ModelKind::car3d), "3d-car");
    EXPECT_EQ(name(ModelKind::msar3d), "3d-msar");
    EXPECT_EQ(name(NoiseForm::full), "full");
    EXPECT_EQ(name(NoiseForm::diagonal), "diagonal");
    EXPECT_EQ(name(Estimator::least_squares), "ls");
    EXPECT_EQ(estimator("ls"), Estimator::least_squares);
}

TEST(Models, UnknownNamesListWhatExists) {
    try {
        static_cast<void>(model_kind("4d-car"));
        FAIL() << "accepted";
    } catch (const InputError& error) {
        const std::string message = error.what();
        for (const char* part : {"4d-car", "3d-car", "3d-msar"})
            EXPECT_NE(message.find(part), std::string::npos) << message;
    }
    EXPECT_THROW(static_cast<void>(model_kind("")), InputError);
    EXPECT_THROW(static_cast<void>(model_kind("3D-CAR")), InputError);
    EXPECT_THROW(static_cast<void>(estimator("ml?")), InputError);
    EXPECT_THROW(static_cast<void>(noise_form("Full")), InputError);
}

TEST(Models, LinearFieldIsTheOneInside) {
    TextureModel car = example_model(ModelKind::car3d), sar = example_model(ModelKind::msar3d);
    EXPECT_EQ(&linear_field(car.levels[0].models.front()), &field_of(car, 0));
    EXPECT_EQ(&linear_field(sar.levels[1].models.front()), &field_of(sar, 1));
}

TEST(Models, ParameterCount) {
    // Second order, causal: 4 offsets. Per level 4 d² coefficients, the free entries of Σ and a gain; d
    // means.
    for (const std::size_t d : {1U, 2U, 3U, 6U}) {
        const std::size_t full = 2 * (4 * d * d + d * (d + 1) / 2 + 1) + d;
        const std::size_t diagonal = 2 * (4 * d * d + d + 1) + d;
        EXPECT_EQ(parameter_count(example_model(ModelKind::car3d, static_cast<int>(d), 2)), full);
        EXPECT_EQ(
            parameter_count(example_model(ModelKind::car3d, static_cast<int>(d), 2, NoiseForm::diagonal)),
            diagonal);
    }
    // d = 2: 16 coefficients, of which numbers 2, 7 and 12 are absent.
    const TextureModel per_pair = example_model(ModelKind::car3d, 2, 1, NoiseForm::full, true);
    EXPECT_EQ(parameter_count(per_pair), 16U - 3U + 3U + 1U + 2U);
}

TEST(Models, ValidWhenEveryLevelCertifies) {
    TextureModel model = example_model();
    EXPECT_TRUE(is_valid(model));
    model.levels[1].certificate.valid = false;
    EXPECT_FALSE(is_valid(model));
}

TEST(Models, CheckAcceptsGoodModels) {
    for (const ModelKind kind : {ModelKind::car3d, ModelKind::msar3d}) {
        for (const int planes : {1, 2, 3, 6}) {
            for (const int levels : {1, 2, 4}) {
                for (const NoiseForm noise : {NoiseForm::full, NoiseForm::diagonal}) {
                    for (const bool per_pair : {false, true}) {
                        EXPECT_EQ(defect(example_model(kind, planes, levels, noise, per_pair)), "");
                    }
                }
            }
        }
    }
}

TEST(Models, CheckAcceptsWhiteNoise) {
    TextureModel model = example_model(ModelKind::car3d, 2, 1);
    field_of(model, 0).offsets.clear();
    field_of(model, 0).coefficients.clear();
    EXPECT_EQ(defect(model), "");
}

TEST(Models, CheckAcceptsWhatAFailedCertificateLeavesUndefined) {
    TextureModel model = example_model();
    model.levels[0].certificate = {false, 0.0, 3, {infinity, nan}};
    model.levels[0].log_likelihood = nan;
    EXPECT_EQ(defect(model), "");
}

struct Spoilt {
    const char* what;  ///< of the defect's description
    std::function<void(TextureModel&)> spoil;
    ModelKind kind = ModelKind::car3d;
    NoiseForm noise = NoiseForm::full;
};

TEST(Models, CheckNamesTheDefect) {
    const std::vector<Spoilt> all{
        {"0 planes", [](TextureModel& m) { m.planes = 0; }},
        {"-2 planes", [](TextureModel& m) { m.planes = -2; }},
        {"picture size is 0 x 37", [](TextureModel& m) { m.size.width = 0; }},
        {"picture size is 50 x -37", [](TextureModel& m) { m.size.height = -37; }},
        {"memory",
         [](TextureModel& m) {
             m.size = {2147483647, 2147483647};
         }},
        {"factor is 1", [](TextureModel& m) { m.factor = 1; }},
        {"factor is -2", [](TextureModel& m) { m.factor = -2; }},
        {"1 mean for", [](TextureModel& m) { m.mean.pop_back(); }},
        {"mean is not finite", [](TextureModel& m) { m.mean[1] = nan; }},
        {"no level", [](TextureModel& m) { m.levels.clear(); }},
        {"level 1: its size is 25 x 18 instead of 25 x 19",
         [](TextureModel& m) { m.levels[1].size.height = 18; }},
        {"level 0: its size", [](TextureModel& m) { std::swap(m.levels[0], m.levels[1]); }},
        {"level 1: it is not a 3d-car",
         [](TextureModel& m) {
             SarModel other;
             static_cast<LinearField&>(other) = field_of(m, 1);
             m.levels[1].models = {other};
         }},
        {"level 0: it is not a 3d-msar", [](TextureModel& m) { m.kind = ModelKind::msar3d; }},
        {"level 1: 3 planes", [](TextureModel& m) { field_of(m, 1).planes = 3; }},
        {"centre",
         [](TextureModel& m) {
             field_of(m, 0).offsets[1] = {0, 0};
         }},
        {"twice", [](TextureModel& m) { field_of(m, 0).offsets[1] = field_of(m, 0).offsets[0]; }},
        {"(0, 1) does not precede",
         [](TextureModel& m) {
             field_of(m, 0).kind = NeighbourhoodKind::custom;
             field_of(m, 0).offsets[1] = {0, 1};
         }},
        {"(1, -1) does not precede",
         [](TextureModel& m) {
             field_of(m, 1).offsets[0] = {1, -1};
         }},
        {"farther",
         [](TextureModel& m) {
             field_of(m, 0).offsets[1] = {-2147483647 - 1, 0};
         }},
        {"farther",
         [](TextureModel& m) {
             field_of(m, 0).offsets[1] = {-1, 32768};
         }},
        {"unilateral", [](TextureModel& m) { field_of(m, 0).kind = NeighbourhoodKind::unilateral; }},
        {"symmetric neighbourhood",
         [](TextureModel& m) {
             field_of(m, 0).offsets[0] = {5, 5};
         },
         ModelKind::msar3d},
        {"half neighbourhood", [](TextureModel& m) { field_of(m, 0).kind = NeighbourhoodKind::half; },
         ModelKind::msar3d},
        {"causal neighbourhood", [](TextureModel& m) { field_of(m, 0).kind = NeighbourhoodKind::causal; },
         ModelKind::msar3d},
        {"15 coefficients instead of 16", [](TextureModel& m) { field_of(m, 0).coefficients.pop_back(); }},
        {"17 coefficients", [](TextureModel& m) { field_of(m, 1).coefficients.push_back(0.0); }},
        {"coefficient 3 is not finite", [](TextureModel& m) { field_of(m, 0).coefficients[3] = infinity; }},
        {"'active'",
         [](TextureModel& m) {
             field_of(m, 0).active = {1, 1};
         }},
        {"neither 0 nor 1", [](TextureModel& m) { field_of(m, 0).active.assign(16, 2); }},
        {"coefficient 5 is not 0",
         [](TextureModel& m) {
             field_of(m, 0).active.assign(16, 1);
             field_of(m, 0).active[5] = 0;
         }},
        {"3 entries instead of 4", [](TextureModel& m) { field_of(m, 0).noise_covariance.pop_back(); }},
        {"noise covariance is not finite", [](TextureModel& m) { field_of(m, 0).noise_covariance[1] = nan; }},
        {"plane 1 is not positive", [](TextureModel& m) { field_of(m, 0).noise_covariance[3] = 0.0; }},
        {"plane 0 is not positive", [](TextureModel& m) { field_of(m, 1).noise_covariance[0] = -1.0; }},
        {"not symmetric", [](TextureModel& m) { field_of(m, 0).noise_covariance[1] *= 1.0 + 1e-9; }},
        {"not positive definite",
         [](TextureModel& m) {
             field_of(m, 0).noise_covariance = {1.0, 1.0, 1.0, 1.0};
         }},
        {"not positive definite",
         [](TextureModel& m) {
             field_of(m, 0).noise_covariance = {1.0, 2.0, 2.0, 1.0};
         }},
        {"not diagonal",
         [](TextureModel& m) {
             field_of(m, 0).noise_covariance[1] = field_of(m, 0).noise_covariance[2] = 1e-5;
         },
         ModelKind::car3d, NoiseForm::diagonal},
        {"gain", [](TextureModel& m) { m.levels[1].gain = -0.1; }},
        {"gain", [](TextureModel& m) { m.levels[1].gain = nan; }},
        {"iterations", [](TextureModel& m) { m.levels[0].iterations = -1; }},
        {"variance ratios", [](TextureModel& m) { m.levels[0].certificate.variance_ratio.push_back(1.0); }},
        {"variance ratio of a valid",
         [](TextureModel& m) { m.levels[0].certificate.variance_ratio[1] = nan; }},
        {"singular value", [](TextureModel& m) { m.levels[0].certificate.min_singular = -1.0; }},
        {"-1 zeros", [](TextureModel& m) { m.levels[0].certificate.zeros = -1; }},
        {"log-likelihood", [](TextureModel& m) { m.levels[1].log_likelihood = nan; }},
    };
    for (const Spoilt& spoilt : all) {
        TextureModel model = example_model(spoilt.kind, 2, 2, spoilt.noise);
        spoilt.spoil(model);
        const std::string found = defect(model);
        EXPECT_NE(found.find(spoilt.what), std::string::npos)
            << "expected '" << spoilt.what << "', got '" << found << "'";
    }
}

TEST(Models, CheckTakesRoundingForSymmetric) {
    TextureModel model = example_model();
    double& entry = field_of(model, 0).noise_covariance[1];
    entry = std::nextafter(entry, 1.0);
    EXPECT_EQ(defect(model), "");
}

}  // namespace
}  // namespace btfield
