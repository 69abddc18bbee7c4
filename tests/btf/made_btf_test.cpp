// host/btf/made_btf.cpp and kernels/btf/made_btf.cl.

#include "btfield/made_btf.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/height.hpp"
#include "host/base/parallel.hpp"
#include "tests/device_cases.hpp"
#include "tests/reference/made_btf.hpp"

namespace btfield {
namespace {

using std::size_t;

BtfDirection at(double theta, double phi) {
    return {theta * std::numbers::pi / 180.0, phi * std::numbers::pi / 180.0};
}

/// Hills, of which a few hide others from 75 degrees.
BtfMaterial hills(Size size, int planes = 3) {
    BtfMaterial m;
    m.height = Image(size, 1);
    m.albedo = Image(size, planes, planes == 3 ? ColourSpace::linear : ColourSpace::unspecified);
    m.roughness = Image(size, 1);
    for (int r = 0; r < size.height; ++r)
        for (int c = 0; c < size.width; ++c) {
            const double x = 2.0 * std::numbers::pi * c / size.width,
                         y = 2.0 * std::numbers::pi * r / size.height;
            m.height.at(0, r, c) =
                static_cast<float>(7.0 + 0.02 * size.width * (std::cos(x + y) + std::sin(2.0 * x - y)));
            m.roughness.at(0, r, c) = static_cast<float>(0.5 + 0.2 * std::cos(y));
            for (int p = 0; p < planes; ++p)
                m.albedo.at(p, r, c) = static_cast<float>(0.5 + 0.3 * std::sin(x * (p + 1) + y));
        }
    m.normals = normals_of_slopes(slopes_of_height(m.height, SurfaceEdges::periodic));
    return m;
}

struct Errors {
    double largest = 0.0, mean = 0.0;
};

Errors compare(Device& device, Size size, int planes) {
    const BtfMaterial m = hills(size, planes);
    MadeBtfOptions options;
    options.views = {at(0, 0), at(30, 120), at(75, 300)};
    options.lights = {at(0, 0), at(45, 200), at(75, 30)};
    const BtfSet set = make_btf(device, m, options);
    Image centred = m.height;
    double mean = 0.0;
    for (const float value : centred.values())
        mean += static_cast<double>(value) / static_cast<double>(area(size));
    for (float& value : centred.values()) value -= static_cast<float>(mean);
    Errors errors;
    double count = 0.0;
    for (int l = 0; l < 3; ++l) {
        const auto light = options.lights[static_cast<size_t>(l)].vector();
        Image lit(size, 1);
        for (int r = 0; r < size.height; ++r)
            for (int c = 0; c < size.width; ++c)
                lit.at(0, r, c) = static_cast<float>(reference::lit(centred, r, c, light));
        for (int v = 0; v < 3; ++v) {
            const auto view = options.views[static_cast<size_t>(v)].vector();
            const Image picture = set.picture(v, l);
            EXPECT_EQ(picture.planes(), planes);
            for (int r = 0; r < size.height; ++r)
                for (int c = 0; c < size.width; ++c) {
                    const reference::Place place = reference::seen_at(centred, r, c, view);
                    const auto map = [&](const Image& of, int p) {
                        return reference::between(of, p, place.x, place.y);
                    };
                    for (int p = 0; p < planes; ++p) {
                        const double expected =
                            reference::reflected(map(m.albedo, p),
                                                 {map(m.normals, 0), map(m.normals, 1), map(m.normals, 2)},
                                                 view, light, map(m.roughness, 0), options.reflectance) *
                            map(lit, 0);
                        const double error = std::abs(static_cast<double>(picture.at(p, r, c)) - expected);
                        EXPECT_FALSE(std::isnan(error));
                        errors.largest = std::max(errors.largest, error);
                        errors.mean += error;
                        ++count;
                    }
                }
        }
    }
    errors.mean /= count;
    return errors;
}

class MadeBtfSmall : public testing::TestWithParam<int> {
  protected:
    Device device_ = test::device_of_width(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Widths, MadeBtfSmall, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(MadeBtfSmall, FollowsTheFormula) {
    // Both find a hit to about a hundredth of a pixel; maps change by a tenth a pixel, shadows by one.
    const Errors errors = compare(device_, {19, 24}, 3);
    EXPECT_LE(errors.largest, 0.02);
    EXPECT_LE(errors.mean, 1e-3);
}

class MadeBtfWidths : public MadeBtfSmall {};
INSTANTIATE_TEST_SUITE_P(Widths, MadeBtfWidths, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(MadeBtfWidths, SizesAndPlanes) {
    for (const Size size : {Size{1, 1}, Size{7, 4}, Size{17, 31}, Size{33, 20}})
        for (const int planes : {1, 4}) {
            const Errors errors = compare(device_, size, planes);
            EXPECT_LE(errors.largest, 0.05) << test::text(size);
            EXPECT_LE(errors.mean, 2e-3) << test::text(size);
        }
}

/// Level, albedo .5, matt.
BtfMaterial level(Size size) {
    BtfMaterial m{Image(size, 1), Image(size, 3), Image(size, 1), {}};
    std::ranges::fill(m.albedo.values(), 0.5F);
    std::ranges::fill(m.normals.plane(2), 1.0F);
    return m;
}

TEST(MadeBtf, ALevelSurfaceIsLamberts) {
    MadeBtfOptions options;
    options.reflectance = 0.0;
    const BtfSet set = make_btf(test::default_device(), level({8, 8}), options);
    EXPECT_EQ(set.format(), "made");
    EXPECT_EQ(set.views().size(), 81U);
    EXPECT_EQ(set.space(), ColourSpace::unspecified);
    for (const int l : {0, 10, 80}) {
        const Image picture = set.picture(40, l);
        const double expected = 0.5 * std::cos(set.lights()[static_cast<size_t>(l)].theta);
        for (const float value : picture.values()) EXPECT_NEAR(value, expected, 1e-6);
    }
}

TEST(MadeBtf, PillarsMoveAndThrowShadows) {
    // A pillar of 10 pixels height in the middle of a level plane; the mean plane lies little above it.
    BtfMaterial m = level({64, 64});
    for (int r = 28; r < 36; ++r)
        for (int c = 28; c < 36; ++c) {
            m.height.at(0, r, c) = 10.0F;
            m.albedo.at(0, r, c) = 1.0F;
        }
    MadeBtfOptions options;
    options.reflectance = 0.0;
    options.views = {at(0, 0), at(45, 0), at(45, 90)};
    options.lights = {at(0, 0), at(45, 0), at(45, 90)};
    const BtfSet set = make_btf(test::default_device(), m, options);
    const double mean = 10.0 * 64.0 / 4096.0;
    EXPECT_NEAR(set.description().height.at(0, 30, 30), 10.0 - mean, 1e-5);
    // A point p shows at p - h (d_x, d_y) / d_z: seen from the right, the top moves to the left by 10 pixels,
    // from the upper edge of the picture downwards.
    const Image right = set.picture(1, 0), up = set.picture(2, 0);
    EXPECT_NEAR(right.at(0, 32, 22), 1.0, 1e-3);
    EXPECT_NEAR(right.at(0, 32, 40), 0.5, 1e-3);
    EXPECT_NEAR(up.at(0, 42, 32), 1.0, 1e-3);
    EXPECT_NEAR(up.at(0, 24, 32), 0.5, 1e-3);
    // Light from the right: the shadow lies left of it, light from above in the picture: below it.
    const Image shadow_left = set.picture(0, 1), shadow_below = set.picture(0, 2);
    EXPECT_NEAR(shadow_left.at(0, 32, 24), 0.0, 1e-3);
    EXPECT_NEAR(shadow_left.at(0, 32, 44), 0.5 * std::sqrt(0.5), 1e-3);
    EXPECT_NEAR(shadow_below.at(0, 40, 32), 0.0, 1e-3);
    EXPECT_NEAR(shadow_below.at(0, 20, 32), 0.5 * std::sqrt(0.5), 1e-3);
}

TEST(MadeBtf, OnePictureIsTheSameWheneverAndByWhomeverItIsAsked) {
    MadeBtfOptions options;
    const BtfSet set = make_btf(test::default_device(), hills({32, 32}), options);
    const Image alone = set.picture(60, 70);
    std::vector<int> differs(40, 0);
    for_each_block(40, [&](int i) {
        static_cast<void>(set.picture((i * 7) % 81, (i * 11) % 81));
        const Image again = set.picture(60, 70);
        differs[static_cast<size_t>(i)] = std::ranges::equal(again.values(), alone.values()) ? 0 : 1;
    });
    EXPECT_EQ(std::ranges::count(differs, 1), 0);
}

TEST(MadeBtf, WhatMakesNoBtfIsRefused) {
    for (int what = 0; what < 8; ++what) {
        BtfMaterial m = level({4, 4});
        MadeBtfOptions options;
        if (what == 0) m.normals = Image({4, 5}, 3);
        if (what == 1) m.height = Image({4, 4}, 2);
        if (what == 2) m.height.at(0, 1, 1) = std::numeric_limits<float>::quiet_NaN();
        if (what == 3) m.roughness = Image({3, 3}, 1);
        if (what == 4) options.roughness = 1.5;
        if (what == 5) options.views.clear();
        if (what == 6) options.lights[3].theta = 1.6;
        if (what == 7) m.albedo = Image();
        EXPECT_THROW(static_cast<void>(make_btf(test::default_device(), m, options)), InputError) << what;
    }
}

}  // namespace
}  // namespace btfield
