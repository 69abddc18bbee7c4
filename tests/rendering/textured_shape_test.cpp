// host/rendering/textured_shape.cpp and the part of btf_renderer.cpp that shows textures.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "btfield/btf_renderer.hpp"
#include "btfield/btf_textures.hpp"
#include "btfield/error.hpp"
#include "btfield/neighbourhood.hpp"
#include "host/btf/contrast_code.hpp"
#include "tests/device_cases.hpp"
#include "tests/example_model.hpp"
#include "tests/rendering_cases.hpp"

namespace btfield {
namespace {

using test::degree;

constexpr Size tile{32, 32};

/// White noise, taken from where it is or from afar: two that do not correlate.
TextureModel noise(bool afar) {
    TextureModel model = test::example_model(ModelKind::ma3d, 3, 1, NoiseForm::diagonal);
    model.space = ColourSpace::unspecified;
    LinearField& field = test::field_of(model, 0);
    field.offsets = neighbourhood(8, field.kind);
    const auto furthest = static_cast<std::size_t>(
        std::ranges::max_element(field.offsets, {},
                                 [](const Offset& s) { return s.row * s.row + s.column * s.column; }) -
        field.offsets.begin());
    field.offsets.push_back({0, 0});
    field.coefficients.assign(9 * field.offsets.size(), 0.0);
    for (std::size_t i = 0; i < 9; i += 4)
        field.coefficients[9 * (afar ? furthest : field.offsets.size() - 1) + i] = 1.0;
    return model;
}

/// All pairs of the 81 directions. A matt surface of one contrast; the textures of neighbours differ.
BtfTextures mixed(bool mixed, BtfMatch match = BtfMatch::means) {
    BtfTextures model;
    model.size = tile;
    model.colours = 3;
    model.match = match;
    model.views = model.lights = btf_directions_81();
    model.textures = {noise(false), noise(true)};
    model.sources = {0, 1};
    model.texture_means.assign(6, 0.25F);
    const std::uint8_t contrast = detail::contrast_code(1.0, 0.25);
    for (int v = 0; v < 81; ++v)
        for (int l = 0; l < 81; ++l) {
            model.pairs.push_back({v, l});
            model.labels.push_back(static_cast<std::uint16_t>(mixed ? (v + l) % 2 : 0));
            if (match == BtfMatch::none) continue;
            const double lit = model.lights[static_cast<std::size_t>(l)].vector()[2];
            for (int c = 0; c < 3; ++c) {
                model.means.push_back(static_cast<float>((0.3 + 0.1 * c) * lit));
                model.contrasts.push_back(contrast);
            }
        }
    return model;
}

BtfRenderer shown(const BtfTextures& model) {
    return {test::default_device(), model, tile, 3};
}

TEST(TexturedShape, APlaneFromAboveIsThePicture) {
    const BtfTextures model = mixed(true);
    const BtfRenderer renderer = shown(model);
    const BtfTextureSynthesiser grown(test::default_device(), model, tile, 3);
    EXPECT_EQ(renderer.tile(), tile);
    EXPECT_TRUE(renderer.tileable());
    const BtfDirection light{50.0 * degree, 2.0};
    const Image truth = grown.picture({}, light),
                found = renderer.picture({BtfShape::plane, {64, 32}, 1.0, 0.0}, {}, light);
    EXPECT_EQ(found.space(), ColourSpace::linear);
    for (int p = 0; p < 3; ++p)
        for (int r = 0; r < 64; ++r)
            for (int c = 0; c < 32; ++c)
                ASSERT_NEAR(found.at(p, r, c), truth.at(p, (r + 16) % 32, c), 1e-5F) << r << " " << c;
    // Beyond the ring only light falls.
    const BtfScene scene{BtfShape::plane, tile, 1.0, 0.0};
    const Image ring = renderer.picture(scene, {}, {75.0 * degree, 1.0}),
                beyond = renderer.picture(scene, {}, {85.0 * degree, 1.0});
    const auto fall = static_cast<float>(std::cos(85.0 * degree) / std::cos(75.0 * degree));
    for (std::size_t i = 0; i < ring.values().size(); ++i)
        ASSERT_NEAR(beyond.values()[i], fall * ring.values()[i], 1e-5F);
}

struct Moments {
    double mean = 0.0, deviation = 0.0;
};
/// Of pixels over the cosine of the light's angle, away from the rim and the terminator.
Moments moments(const Image& ball, int plane, const BtfDirection& light) {
    const auto l = light.vector();
    const double radius = 0.45 * ball.size().height, middle = 0.5 * (ball.size().height - 1);
    double sum = 0.0, squares = 0.0, count = 0.0;
    for (int r = 0; r < ball.size().height; ++r)
        for (int c = 0; c < ball.size().width; ++c) {
            const double x = (c - middle) / radius, y = (middle - r) / radius, out = x * x + y * y;
            if (out > 0.8) continue;
            const double lit = x * l[0] + y * l[1] + std::sqrt(1.0 - out) * l[2];
            if (lit < 0.3) continue;
            const double value = static_cast<double>(ball.at(plane, r, c)) / lit;
            sum += value;
            squares += value * value;
            count += 1.0;
        }
    return {sum / count, std::sqrt(squares / count - sum * sum / (count * count))};
}

TEST(TexturedShape, BlendedTexturesKeepMeanAndContrast) {
    const BtfScene scene{BtfShape::sphere, {241, 241}, 1.0, 0.02};
    const BtfDirection light{40.0 * degree, 1.0};
    const Image one = shown(mixed(false)).picture(scene, {}, light),
                two = shown(mixed(true)).picture(scene, {}, light);
    for (int p = 0; p < 3; ++p) {
        const Moments a = moments(one, p, light), b = moments(two, p, light);
        EXPECT_NEAR(a.mean, 0.3 + 0.1 * p, 0.01 * a.mean);
        EXPECT_NEAR(b.mean, a.mean, 0.01 * a.mean);
        // Mixed without care, noise of two textures has three quarters of it.
        EXPECT_NEAR(b.deviation, a.deviation, 0.06 * a.deviation);
        EXPECT_GT(a.deviation, 0.1 * a.mean);
    }
    EXPECT_EQ(two.at(1, 3, 3), 0.02F);
    const Image low = shown(mixed(true)).picture(scene, {}, {80.0 * degree, 180.0 * degree});
    EXPECT_EQ(low.at(0, 120, 210), 0.0F);
    EXPECT_GT(low.at(0, 120, 36), 0.05F);
    // Wherever the camera is, it is the same ball.
    const Image aside = shown(mixed(true)).picture(scene, {60.0 * degree, 2.0}, light);
    EXPECT_GT(moments(aside, 0, {20.0 * degree, 1.0}).mean, 0.1);
}

TEST(TexturedShape, UnmatchedPicturesStayAsTheyAreAndEndAtTheTerminator) {
    const BtfRenderer renderer = shown(mixed(true, BtfMatch::none));
    const BtfScene scene{BtfShape::sphere, {121, 121}, 1.0, 0.0};
    const BtfDirection light{30.0 * degree, 0.0};
    const Image ball = renderer.picture(scene, {}, light);
    double lit = 0.0, steep = 0.0;
    for (int r = 50; r < 70; ++r)
        for (int c = 0; c < 10; ++c) {
            lit += static_cast<double>(ball.at(0, r, 60 + c)) / 200.0;
            steep +=
                static_cast<double>(ball.at(0, r, 23 + c)) / 200.0;  // 60 degrees and more from the light
        }
    // E z² = (mean² + variance) · 0.25 of textures whose mean is 0.3 + √2 / 10.
    const double mean = 0.3 + std::sqrt(2.0) / 10.0, expected = 0.25 * (mean * mean + 0.01 / 3.0);
    EXPECT_NEAR(lit, expected, 0.05 * expected);
    EXPECT_NEAR(steep, expected, 0.05 * expected);
    for (int r = 0; r < 121; ++r) EXPECT_LT(ball.at(0, r, 12), 0.6 * expected);
}

TEST(TexturedShape, TheSameEveryTime) {
    const BtfScene scene{BtfShape::sphere, {60, 60}, 1.5, 0.02};
    const BtfRenderer renderer = shown(mixed(true));
    const Image first = renderer.picture(scene, {0.4, 1.0}, {0.8, 3.0});
    static_cast<void>(renderer.picture(scene, {0.2, 2.0}, {0.3, 1.0}));
    const Image again = renderer.picture(scene, {0.4, 1.0}, {0.8, 3.0});
    EXPECT_TRUE(std::ranges::equal(first.values(), again.values()));
    EXPECT_THROW(static_cast<void>(renderer.picture(scene, {1.56, 0.0}, {})), InputError);
}

}  // namespace
}  // namespace btfield
