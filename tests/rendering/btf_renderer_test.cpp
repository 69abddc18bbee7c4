// host/rendering/btf_renderer.cpp.

#include "btfield/btf_renderer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "btfield/error.hpp"
#include "tests/device_cases.hpp"
#include "tests/rendering_cases.hpp"

namespace btfield {
namespace {

using test::degree;

constexpr Size tile{20, 24};

class BtfRendered : public testing::Test {
  protected:
    BtfModel model_ = test::smooth_btf(tile);
    Image surface_ = test::smooth_surface(tile, 5);
    BtfRenderer renderer_{test::default_device(), model_, surface_};
    BtfSynthesiser shown_{test::default_device(), model_, surface_};
};

TEST_F(BtfRendered, APlaneFromAboveIsThePicture) {
    const BtfDirection view{}, light{50.0 * degree, 2.0};
    const Image truth = shown_.picture(view, light);
    // Over and over, from the first pixel on, for any even sides.
    for (const Size size : {tile, Size{50, 40}}) {
        const Image found = renderer_.picture({BtfShape::plane, size, 1.0, 0.0}, view, light);
        ASSERT_EQ(found.size(), size);
        EXPECT_EQ(found.space(), ColourSpace::linear);
        const int down = size == tile ? 0 : 15, right = size == tile ? 0 : 8;
        for (int p = 0; p < 3; ++p)
            for (int r = 0; r < size.height; ++r)
                for (int c = 0; c < size.width; ++c)
                    ASSERT_NEAR(found.at(p, r, c),
                                truth.at(p, (r - down + 2 * tile.height) % tile.height,
                                         (c - right + 2 * tile.width) % tile.width),
                                1e-5F)
                        << r << " " << c;
    }
}

TEST_F(BtfRendered, APlaneFromTheSideIsForeshortened) {
    // Twice as large, and half of it along the view: there a pixel is a texel again.
    const BtfDirection view{60.0 * degree, 0.0}, light{40.0 * degree, 1.0};
    const Image truth = shown_.picture(view, light);
    const Size size{41, 25};
    const Image found = renderer_.picture({BtfShape::plane, size, 2.0, 0.0}, view, light);
    // The middle, pixel (20, 12), is texel (9, 11): whole ones from there to the tile's middle (9.5, 11.5).
    for (int r = -8; r <= 8; ++r)
        for (int c = -11; c <= 11; ++c)
            ASSERT_NEAR(found.at(1, 20 + 2 * r, 12 + c), truth.at(1, 9 + r, 11 + c), 2e-3F) << r << " " << c;
}

TEST_F(BtfRendered, PicturesDoNotDependOnThoseBefore) {
    const BtfScene scene{BtfShape::plane, {30, 34}, 1.0, 0.0}, larger{BtfShape::plane, {30, 34}, 2.0, 0.0};
    const BtfDirection view{0.7, 1.0}, other{0.7, 2.0}, light{0.5, 2.0};
    const auto fresh = [&](const BtfScene& of, const BtfDirection& from) {
        return BtfRenderer(test::default_device(), model_, surface_).picture(of, from, light);
    };
    static_cast<void>(renderer_.picture(scene, view, {0.9, 4.0}));
    for (const auto& [of, from] :
         {std::pair(scene, view), std::pair(scene, other), std::pair(larger, other)}) {
        const Image first = renderer_.picture(of, from, light), truth = fresh(of, from);
        EXPECT_TRUE(std::ranges::equal(first.values(), truth.values()));
    }
}

TEST_F(BtfRendered, LightBeyondTheRingFallsAsTheCosine) {
    const BtfScene scene{BtfShape::plane, tile, 1.0, 0.0};
    const Image ring = renderer_.picture(scene, {}, {75.0 * degree, 1.0}),
                beyond = renderer_.picture(scene, {}, {85.0 * degree, 1.0});
    const auto fall = static_cast<float>(std::cos(85.0 * degree) / std::cos(75.0 * degree));
    for (std::size_t i = 0; i < ring.values().size(); ++i)
        ASSERT_NEAR(beyond.values()[i], fall * ring.values()[i], 1e-5F);
}

TEST_F(BtfRendered, TheMiddleOfASphereIsAPlane) {
    const BtfDirection view{}, light{30.0 * degree, 2.5};
    const BtfScene sphere{BtfShape::sphere, {401, 401}, 1.0, 0.02};
    const int around = tiles_around(sphere, tile.width);
    EXPECT_EQ(around, 47);  // 2 pi 0.45 401 / 24
    const Image ball = renderer_.picture(sphere, view, light);
    const BtfScene plane{BtfShape::plane, {21, 25}, 2.0 * 3.14159265 * 0.45 * 401 / (47.0 * 24.0), 0.0};
    const Image flat = renderer_.picture(plane, view, light);
    // The tile's middle lies between texels: half a texel beside the plane's, which is a whole one from it.
    double apart = 0.0, mean = 0.0;
    for (int r = 0; r < 5; ++r)
        for (int c = 0; c < 5; ++c) {
            apart += std::abs(static_cast<double>(ball.at(1, 198 + r, 198 + c) - flat.at(1, 8 + r, 10 + c)));
            mean += static_cast<double>(flat.at(1, 8 + r, 10 + c));
        }
    EXPECT_LT(apart, 0.1 * mean);
    EXPECT_GT(mean, 1.0);
    // Beside the sphere the background, behind the terminator nothing.
    EXPECT_EQ(ball.at(2, 3, 3), 0.02F);
    const Image low = renderer_.picture(sphere, view, {80.0 * degree, 180.0 * degree});
    EXPECT_EQ(low.at(0, 200, 350), 0.0F);
    EXPECT_GT(low.at(0, 200, 60), 0.05F);
}

TEST_F(BtfRendered, ValuesAreSharesOfWhite) {
    BtfModel bright = model_;
    bright.white = 100.0;
    bright.space = ColourSpace::xyz;
    for (float& mean : bright.tables.mean) mean *= 100.0F;
    const BtfRenderer other(test::default_device(), bright, surface_);
    const BtfScene scene{BtfShape::sphere, {40, 40}, 1.0, 0.1};
    const Image a = renderer_.picture(scene, {0.3, 1.0}, {0.5, 2.0}),
                b = other.picture(scene, {0.3, 1.0}, {0.5, 2.0});
    EXPECT_EQ(b.space(), ColourSpace::xyz);
    // Grey is grey in any colours.
    EXPECT_NEAR(b.at(0, 0, 0), 0.095047F, 1e-6F);
    EXPECT_NEAR(b.at(2, 0, 0), 0.108883F, 1e-6F);
    for (int r = 15; r < 25; ++r)
        for (int c = 15; c < 25; ++c) EXPECT_NEAR(b.at(1, r, c), a.at(1, r, c), 1e-4F);
}

TEST_F(BtfRendered, WhatCannotBeMetIsRefused) {
    const auto refused = [&](const BtfScene& scene, const BtfDirection& view, const BtfDirection& light) {
        EXPECT_THROW(static_cast<void>(renderer_.picture(scene, view, light)), InputError);
    };
    refused({BtfShape::plane, {8, 8}, 0.0, 0.0}, {}, {});
    refused({BtfShape::plane, {8, 8}, 1.0, -1.0}, {}, {});
    refused({BtfShape::plane, {0, 8}, 1.0, 0.0}, {}, {});
    refused({}, {1.56, 0.0}, {});
    refused({}, {}, {-0.1, 0.0});
    EXPECT_THROW(BtfRenderer(test::default_device(), model_, Image(tile, 2)), InputError);
}

TEST(BtfRenderedRim, FlecksAreTheMaterials) {
    // Rough from pixel to pixel: what samples miss would show at the rim, where a pixel has many texels.
    const BtfModel model = test::smooth_btf({48, 48}, 1);
    Image surface({48, 48}, 6);
    std::mt19937 generator(3);
    std::normal_distribution<float> normal;
    for (float& value : surface.values()) value = 0.5F * normal(generator);
    Device device;
    const BtfRenderer renderer(device, model, surface);
    constexpr int side = 192, fine = 4;
    BtfScene scene;
    scene.shape = BtfShape::sphere;
    scene.size = {side, side};
    scene.scale = 2.0;
    const BtfDirection view{0.0, 0.0}, light{0.8, 2.3};
    const Image seen = renderer.picture(scene, view, light);
    scene.size = {fine * side, fine * side};
    scene.scale *= fine;
    const Image closer = renderer.picture(scene, view, light);
    double errors = 0.0, sum = 0.0, squares = 0.0;
    int count = 0;
    for (int r = 0; r < side; ++r)
        for (int c = 0; c < side; ++c) {
            const double x = c - 0.5 * (side - 1), y = 0.5 * (side - 1) - r;
            const double out = std::hypot(x, y) / (0.45 * side);
            // As far out as pixels have no share of the background, where the light falls.
            if (out < 0.85 || out > 0.98 || x * std::cos(light.phi) + y * std::sin(light.phi) < 0.0) continue;
            double mean = 0.0;
            for (int i = 0; i < fine * fine; ++i)
                mean += static_cast<double>(closer.at(0, fine * r + i / fine, fine * c + i % fine));
            mean /= fine * fine;
            errors += std::pow(static_cast<double>(seen.at(0, r, c)) - mean, 2);
            sum += mean;
            squares += mean * mean;
            ++count;
        }
    const double variance = squares / count - std::pow(sum / count, 2);
    EXPECT_GT(std::sqrt(variance), 0.05 * sum / count);
    EXPECT_LT(std::sqrt(errors / count), 0.12 * std::sqrt(variance));
}

TEST(BtfShapes, HaveNames) {
    EXPECT_EQ(name(BtfShape::plane), "plane");
    EXPECT_EQ(name(BtfShape::sphere), "sphere");
    EXPECT_EQ(tiles_around({BtfShape::sphere, {4, 4}, 1.0, 0.0}, 512), 1);
}

}  // namespace
}  // namespace btfield
