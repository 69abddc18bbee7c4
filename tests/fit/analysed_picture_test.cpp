#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/fit.hpp"
#include "btfield/image_io.hpp"
#include "host/fit/likelihood.hpp"
#include "tests/device_cases.hpp"
#include "tests/places.hpp"

namespace btfield {

using namespace detail;

namespace {

Device& device() {
    return test::default_device();
}

Image crop_of_cork() {
    return read_picture(test::data_folder() + "/cork.png", Crop{0, 0, 64, 64}).image;
}

TEST(Analysis, FitsSideBySideAreTheFitsOneByOne) {
    const Image image = crop_of_cork();
    std::vector<FitOptions> all;
    for (const ModelKind kind : model_kinds()) {
        FitOptions& options = all.emplace_back();
        options.model = kind;
        options.order = 1;
        options.levels = 2;
    }
    Analysis together(device(), image);
    const std::vector<TextureModel> models = together.fit_all(all);
    ASSERT_EQ(models.size(), all.size());
    for (std::size_t k = 0; k < all.size(); ++k) {
        const TextureModel alone = fit(device(), image, all[k]);
        EXPECT_EQ(models[k].kind, all[k].model);
        EXPECT_EQ(models[k].whitening, alone.whitening);
        ASSERT_EQ(models[k].levels.size(), alone.levels.size());
        for (std::size_t l = 0; l < alone.levels.size(); ++l) {
            const LevelModel &a = models[k].levels[l], &b = alone.levels[l];
            EXPECT_EQ(a.gain, b.gain);
            ASSERT_EQ(a.models.size(), b.models.size());
            for (std::size_t p = 0; p < a.models.size(); ++p) {
                EXPECT_EQ(linear_field(a.models[p]).coefficients, linear_field(b.models[p]).coefficients)
                    << name(all[k].model) << " " << l;
            }
        }
    }
}

TEST(Analysis, AFitThatFailsSpoilsNoOther) {
    Analysis analysis(device(), crop_of_cork());
    std::vector<FitOptions> all(2);
    all[1].levels = 6;
    EXPECT_THROW(static_cast<void>(analysis.fit_all(all)), InputError);
    EXPECT_TRUE(is_valid(analysis.fit(all[0])));
}

TEST(Analysis, TooManyUnknownsForANewtonStepAreSaid) {
    EXPECT_NO_THROW(check_dense_hessian("fit", 6000, "use another"));
    try {
        check_dense_hessian("fit many planes", 23560, "use another");
        FAIL() << "nothing was thrown";
    } catch (const InputError& error) {
        const std::string text = error.what();
        EXPECT_NE(text.find("fit many planes"), std::string::npos) << text;
        EXPECT_NE(text.find("23560"), std::string::npos) << text;
        EXPECT_NE(text.find("use another"), std::string::npos) << text;
    }
}

}  // namespace
}  // namespace btfield
