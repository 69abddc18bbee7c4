#include "btfield/relighting.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "btfield/error.hpp"
#include "tests/device_cases.hpp"
#include "tests/light_cases.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using test::Direction;
using test::TemporaryFolder;

/// Level but for a wall of this height in column `at`.
Surface wall(Size size, int at, float height, SurfaceEdges edges) {
    Surface surface{Image(size, 3), Image(size, 2), Image(size, 1), edges};
    std::ranges::fill(surface.normals.plane(2), 1.0F);
    std::ranges::fill(surface.albedo.plane(0), 0.5F);
    std::ranges::fill(surface.albedo.plane(1), 0.25F);
    for (int r = 0; r < size.height; ++r) surface.height.at(0, r, at) = height;
    return surface;
}

TEST(Relighting, Angles) {
    const Direction right = direction_of_angles(90.0, 0.0), up = direction_of_angles(30.0, 90.0);
    EXPECT_NEAR(right[0], 1.0, 1e-12);
    EXPECT_NEAR(up[0], 0.0, 1e-12);
    EXPECT_NEAR(up[1], 0.5, 1e-12);
    EXPECT_NEAR(up[2], std::sqrt(0.75), 1e-12);
}

TEST(Relighting, LambertsLaw) {
    const Image normals = test::hilly_normals({14, 18});
    Surface surface{normals, Image({14, 18}, 3), {}, SurfaceEdges::mirror};
    for (int p = 0; p < 3; ++p)
        for (int r = 0; r < 14; ++r)
            for (int c = 0; c < 18; ++c) surface.albedo.at(p, r, c) = test::albedo_at(p, r, c);
    const Direction light{2.0, -1.0, 3.0};  // of any length
    Direction unit = light;
    for (double& x : unit) x /= std::sqrt(14.0);
    const Image expected = test::lit(normals, 3, {.direction = unit}, 1);
    const Image found = relight(surface, light);
    ASSERT_EQ(found.planes(), 3);
    EXPECT_EQ(found.space(), ColourSpace::linear);
    for (std::size_t i = 0; i < found.values().size(); ++i)
        ASSERT_NEAR(found.values()[i], expected.values()[i], 1e-6F);
}

TEST(Relighting, WallsThrowShadows) {
    // At 45 degrees from the right a wall of 6 pixels reaches 6 pixels to the left; its edge is soft.
    const Size size{3, 40};
    const Direction from_right = direction_of_angles(45.0, 0.0);
    const float full = 0.5F * std::sqrt(0.5F);
    const Image mirror = relight(wall(size, 20, 6.0F, SurfaceEdges::mirror), from_right);
    for (int c = 0; c < 40; ++c) {
        const bool shadow = c >= 16 && c < 20, light_is_there = c < 13 || c >= 20;
        if (shadow || light_is_there) {
            EXPECT_NEAR(mirror.at(0, 1, c), shadow ? 0.0F : full, 1e-6F) << c;
        }
        EXPECT_NEAR(mirror.at(1, 1, c), 0.5F * mirror.at(0, 1, c), 1e-7F);
    }
    // On the torus a shadow goes on beyond the edge; between mirrors it does not come from there.
    const Image torus = relight(wall(size, 2, 6.0F, SurfaceEdges::periodic), from_right);
    const Image edge = relight(wall(size, 2, 6.0F, SurfaceEdges::mirror), from_right);
    EXPECT_EQ(torus.at(0, 1, 38), 0.0F);
    EXPECT_NEAR(edge.at(0, 1, 38), full, 1e-6F);
    // From straight above there are none, and none without a height.
    const Image above = relight(wall(size, 20, 6.0F, SurfaceEdges::mirror), {0.0, 0.0, 1.0});
    for (const float value : above.plane(0)) EXPECT_EQ(value, 0.5F);
    Surface without = wall(size, 20, 6.0F, SurfaceEdges::mirror);
    without.height = Image();
    const Image lit_everywhere = relight(without, from_right);
    for (const float value : lit_everywhere.plane(0)) EXPECT_NEAR(value, full, 1e-6F);
}

TEST(Relighting, UpIsUp) {
    // A wall across; the light comes from above in the picture, so the shadow falls below it.
    const Size size{40, 3};
    Surface surface{Image(size, 3), Image(size, 1), Image(size, 1), SurfaceEdges::mirror};
    std::ranges::fill(surface.normals.plane(2), 1.0F);
    std::ranges::fill(surface.albedo.plane(0), 1.0F);
    for (int c = 0; c < 3; ++c) surface.height.at(0, 20, c) = 6.0F;
    const Image image = relight(surface, direction_of_angles(45.0, 90.0));
    EXPECT_EQ(image.at(0, 23, 1), 0.0F);
    EXPECT_NEAR(image.at(0, 17, 1), std::sqrt(0.5F), 1e-6F);
}

TEST(Relighting, WhatCannotBeRelit) {
    const Surface surface = wall({4, 4}, 1, 1.0F, SurfaceEdges::mirror);
    EXPECT_THROW((void)relight(surface, {1.0, 0.0, 0.0}), InputError);
    EXPECT_THROW((void)relight(surface, {0.0, 0.0, 0.0}), InputError);
    EXPECT_THROW((void)relight(surface, {0.0, 0.0, -1.0}), InputError);
    Surface other = surface;
    other.height = Image({4, 5}, 1);
    EXPECT_THROW((void)relight(other, {0.0, 0.0, 1.0}), InputError);
    other = surface;
    other.albedo = Image({5, 4}, 1);
    EXPECT_THROW((void)relight(other, {0.0, 0.0, 1.0}), InputError);
}

TEST(Relighting, LightsAreScored) {
    const TemporaryFolder folder;
    test::put_lights(folder / "stack", {20, 24}, 9, 1, PixelType::uint16, ".png");
    LightSet set = read_light_set(folder / "stack");
    ReliefOptions options;
    options.rule = LightRule::ls;
    const Relief relief = fit_relief(test::default_device(), set, options);
    const Surface surface{relief.normals, relief.albedo, {}, SurfaceEdges::mirror};
    const std::vector<LightScore> scores = score_lights(surface, set, LightCoding::linear);
    ASSERT_EQ(scores.size(), 9U);
    // Pictures of 16 bits of what is rendered.
    for (const LightScore& score : scores) EXPECT_LE(score.error, 1e-3) << score.picture;
    EXPECT_EQ(scores[4].picture, set.lights[4].picture);
    // A light from elsewhere, one of twice the intensity: half of what is told is there.
    set.lights[1].direction = direction_of_angles(70.0, 10.0);
    set.lights[2].intensity = {2.0};
    const std::vector<LightScore> wrong = score_lights(surface, set, LightCoding::linear);
    EXPECT_GE(wrong[1].error, 0.05);
    EXPECT_NEAR(wrong[2].error, 1.0, 2e-3);
    EXPECT_EQ(wrong[3].error, scores[3].error);
    EXPECT_THROW((void)score_lights(surface, set, LightCoding::linear, 2.2, Crop{0, 0, 5, 5}), InputError);
}

}  // namespace
}  // namespace btfield
