// host/btf/texture_code.cpp.

#include "host/btf/texture_code.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "tests/example_model.hpp"

namespace btfield {
namespace {

TEST(TextureCode, NumbersComeBackWhateverTheyAre) {
    for (const ModelKind kind : model_kinds())
        for (const bool marginals : {false, true}) {
            TextureModel model = test::example_model(kind, 3, 2, NoiseForm::full, false, marginals);
            model.levels[0].certificate.valid = false;
            model.levels[0].log_likelihood = std::numeric_limits<double>::quiet_NaN();
            const auto value = nlohmann::json(detail::textures_value({model, model}, true));
            EXPECT_EQ(value["forms"].size(), 1U);
            const std::vector<TextureModel> back = detail::textures_from(value, "textures", {"read"});
            ASSERT_EQ(back.size(), 2U);
            EXPECT_EQ(linear_field(back[1].levels[0].models[0]).coefficients,
                      linear_field(model.levels[0].models[0]).coefficients);
            EXPECT_TRUE(std::isnan(back[1].levels[0].log_likelihood));
            EXPECT_EQ(back[1].basis.matrix, model.basis.matrix);
            const TextureModel rounded = detail::single_precision(model);
            EXPECT_LE(detail::coded_bytes(rounded), detail::coded_bytes(model));
            EXPECT_NEAR(linear_field(rounded.levels[0].models[0]).coefficients[0],
                        linear_field(model.levels[0].models[0]).coefficients[0], 1e-6);
        }
}

}  // namespace
}  // namespace btfield
