// Pictures that are no usual ones: of two colours, and in any unit.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>

#include "btfield/compound.hpp"
#include "btfield/image_io.hpp"
#include "tests/device_cases.hpp"
#include "tests/places.hpp"
#include "tests/plane_statistics.hpp"

namespace btfield {
namespace {

const std::string data = test::data_folder();

double deviation(const Image& image, int plane) {
    return test::statistics_of(image.plane(plane)).deviation;
}

TEST(CompoundPictures, TwoColoursInAnyModel) {
    // What is left of them is rounding, and repeats itself: no model of it can be fitted.
    Image image({64, 64}, 3, ColourSpace::srgb);
    for (int r = 0; r < 64; ++r)
        for (int c = 0; c < 64; ++c)
            for (int p = 0; p < 3; ++p)
                image.at(p, r, c) = (r / 16 + c / 16) % 2 == 0 ? 0.1F : 0.3F + 0.2F * static_cast<float>(p);
    for (const ModelKind kind : {ModelKind::car2d, ModelKind::car3d, ModelKind::msar3d, ModelKind::mmrf3d,
                                 ModelKind::pmrf2d, ModelKind::pmrf3d})
        for (const MarginalMode marginals : {MarginalMode::none, MarginalMode::match}) {
            SCOPED_TRACE(std::string(name(kind)) + " " + std::string(name(marginals)));
            CompoundOptions options;
            options.local.model = kind;
            options.local.marginals = marginals;
            const CompoundModel model = fit_compound(test::default_device(), image, options);
            EXPECT_EQ(model.regions.size(), 2U);
            EXPECT_TRUE(is_valid(model));
            EXPECT_NO_THROW(check(model));
            EXPECT_EQ(model.provenance.reasons.back(),
                      "regions of one colour are white noise that does not show: 0, 1");
            const Image texture =
                CompoundSynthesiser(test::default_device(), model, image.size()).synthesise(1, model.control);
            double worst = 0.0;
            for (std::size_t n = 0; n < texture.values().size(); ++n)
                worst =
                    std::max(worst, std::abs(static_cast<double>(texture.values()[n] - image.values()[n])));
            EXPECT_LT(worst, 0.02);
        }
}

/// Numbers of regions' pixels that differ, relative to all.
double differing(const ControlField& a, const ControlField& b) {
    EXPECT_EQ(a.regions, b.regions);
    double count = 0.0;
    for (std::size_t n = 0; n < a.labels.size(); ++n) count += a.labels[n] != b.labels[n] ? 1.0 : 0.0;
    return count / static_cast<double>(a.labels.size());
}

TEST(CompoundPictures, UnitsOfThePictureDoNotMatter) {
    Image light = read_picture(data + "/bark.png", Crop{0, 0, 96, 96}).image;
    light.set_space(ColourSpace::linear);
    Image coded = light;
    coded.set_space(ColourSpace::srgb);
    const float largest = *std::ranges::max_element(coded.values());
    for (float& value : coded.values()) value /= largest;
    Image data_planes(light.size(), 2);
    for (int p = 0; p < 2; ++p) std::ranges::copy(light.plane(p), data_planes.plane(p).begin());
    for (const Image& image : {light, coded, data_planes})
        for (const ModelKind kind : {ModelKind::ma3d, ModelKind::car3d}) {
            if (kind == ModelKind::car3d && image.space() != ColourSpace::linear) continue;
            CompoundOptions options;
            options.local.model = kind;
            options.local.order = 2;
            const CompoundModel model = fit_compound(test::default_device(), image, options);
            EXPECT_GT(model.control.regions, 2);
            for (const float factor : {1e-12F, 1e6F}) {
                SCOPED_TRACE(std::string(name(image.space())) + " " + std::string(name(kind)) + " " +
                             std::to_string(factor));
                Image scaled = image;
                for (float& value : scaled.values()) value *= factor;
                const CompoundModel other = fit_compound(test::default_device(), scaled, options);
                // Of products that float32 rounds, a pixel between two colours may go to the other.
                EXPECT_LE(differing(other.control, model.control), 1e-3);
                EXPECT_NEAR(other.explained, model.explained, 1e-3);
                const auto d = static_cast<double>(factor);
                for (std::size_t k = 0; k < model.regions.size(); ++k)
                    EXPECT_NEAR(other.regions[k].colour[0] / d, model.regions[k].colour[0], 1e-3);
                const Image a = CompoundSynthesiser(test::default_device(), model, image.size(), true)
                                    .synthesise(1, model.control);
                const Image b = CompoundSynthesiser(test::default_device(), other, image.size(), true)
                                    .synthesise(1, model.control);
                EXPECT_NEAR(deviation(b, 0) / d / deviation(a, 0), 1.0, 0.02);
            }
        }
}

}  // namespace
}  // namespace btfield
