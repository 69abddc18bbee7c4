#include "btfield/light_trend.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "tests/places.hpp"

namespace btfield {
namespace {

double decoded(double v) {
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}
double encoded(double v) {
    return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055;
}

/// Light of 1 + slope x + bowl (x² + y²), x and y on [−1, 1], on a picture in sRGB.
Image lit(const Image& image, double slope, double bowl) {
    Image result = image;
    for (int p = 0; p < image.planes(); ++p)
        for (int r = 0; r < image.height(); ++r)
            for (int c = 0; c < image.width(); ++c) {
                const double x = (2.0 * c + 1.0) / image.width() - 1.0,
                             y = (2.0 * r + 1.0) / image.height() - 1.0;
                const double light = 1.0 + slope * x + bowl * (x * x + y * y);
                result.at(p, r, c) = static_cast<float>(encoded(decoded(image.at(p, r, c)) * light));
            }
    return result;
}

Image picture(const char* name) {
    return read_picture(test::data_folder() + "/" + name).image;
}

std::vector<double> moments(const Image& image, int p) {
    double mean = 0.0, square = 0.0;
    for (const float v : image.plane(p)) {
        mean += decoded(v);
        square += decoded(v) * decoded(v);
    }
    const auto count = static_cast<double>(image.plane(p).size());
    return {mean / count, std::sqrt(square / count - mean * mean / count / count)};
}

TEST(LightTrend, EvenPicturesRaiseNoAlarm) {
    for (const char* name : {"bark.png", "cork.png", "grass.png", "rock.png", "sand.png"})
        EXPECT_FALSE(light_trend(picture(name))) << name;
}

TEST(LightTrend, PartsOfLargeStonesAreNoLight) {
    EXPECT_FALSE(light_trend(read_picture(test::data_folder() + "/rock.png", Crop{0, 0, 96, 80}).image));
}

TEST(LightTrend, MadeGradientsAreFound) {
    for (const double slope : {0.05, 0.1, 0.15}) {
        const auto found = light_trend(lit(picture("cork.png"), slope, 0.0));
        ASSERT_TRUE(found) << slope;
        EXPECT_EQ(found->shape, Flattening::plane);
        EXPECT_NEAR(found->range, 2.0 * slope, 0.02);
    }
    const auto bowl = light_trend(lit(picture("cork.png"), 0.0, -0.1));
    ASSERT_TRUE(bowl);
    EXPECT_EQ(bowl->shape, Flattening::low);
    for (const char* name : {"grass.png", "sand.png"})
        EXPECT_TRUE(light_trend(lit(picture(name), 0.15, 0.0))) << name;
    EXPECT_FALSE(light_trend(Image({63, 64}, 1, ColourSpace::srgb)));
    Image data({64, 64}, 1);
    for (int c = 0; c < 64; ++c)
        for (int r = 0; r < 64; ++r) data.at(0, r, c) = static_cast<float>(c);
    EXPECT_FALSE(light_trend(data)) << "it has no colours";
}

TEST(LightTrend, WhatIsTakenOutLeavesTheEvenPicture) {
    const Image even = picture("cork.png");
    for (const auto& [slope, bowl, how] :
         {std::tuple{0.15, 0.0, Flattening::plane}, std::tuple{0.1, -0.1, Flattening::low}}) {
        const Image uneven = lit(even, slope, bowl);
        const FlattenedPicture flat = flattened(uneven, how);
        EXPECT_FALSE(light_trend(flat.image));
        // The even picture's own trend goes, too.
        const Image wanted = flattened(even, how).image;
        for (int p = 0; p < 3; ++p) {
            const std::vector<double> before = moments(uneven, p), after = moments(flat.image, p),
                                      own = moments(wanted, p);
            EXPECT_NEAR(after[0], before[0], 1e-6 * before[0]);
            EXPECT_NEAR(after[1] / after[0], own[1] / own[0], 0.004 * own[1] / own[0]);
            EXPECT_GT(before[1] / before[0], 1.01 * own[1] / own[0]);
        }
    }
}

TEST(LightTrend, DataLoseTheirTrendBySubtraction) {
    std::mt19937 random(1);
    std::normal_distribution<float> normal(0.0F, 1.0F);
    Image height({80, 96}, 1), with = height;
    for (int r = 0; r < 80; ++r)
        for (int c = 0; c < 96; ++c) {
            height.at(0, r, c) = normal(random);
            with.at(0, r, c) =
                height.at(0, r, c) + 0.1F * static_cast<float>(c) - 0.05F * static_cast<float>(r);
        }
    const Image a = flattened(height, Flattening::plane).image, b = flattened(with, Flattening::plane).image;
    const float shift = b.at(0, 0, 0) - a.at(0, 0, 0);  // means stay
    for (int r = 0; r < 80; r += 7)
        for (int c = 0; c < 96; c += 5) EXPECT_NEAR(b.at(0, r, c) - a.at(0, r, c), shift, 1e-4);
}

TEST(LightTrend, RefusesWhatCannotBeDivided) {
    EXPECT_THROW((void)flattened(picture("sand.png"), Flattening::none), InputError);
    Image dark({64, 64}, 1, ColourSpace::linear);
    for (int r = 0; r < 64; ++r)
        for (int c = 0; c < 64; ++c) dark.at(0, r, c) = static_cast<float>(c) / 64.0F;
    // The other shape is proposed where it does better, and nowhere else.
    const auto refusal = [](const Image& image, Flattening how) -> std::string {
        try {
            (void)flattened(image, how);
        } catch (const InputError& error) {
            return error.what();
        }
        return {};
    };
    for (const Flattening how : {Flattening::plane, Flattening::low}) {
        const std::string text = refusal(dark, how);
        EXPECT_NE(text.find("divided out; use a part of the picture"), std::string::npos) << text;
    }
    Image bowl({64, 64}, 1, ColourSpace::linear);
    for (int r = 0; r < 64; ++r)
        for (int c = 0; c < 64; ++c)
            bowl.at(0, r, c) = 1.0F - static_cast<float>((r - 32) * (r - 32) + (c - 32) * (c - 32)) / 2100.0F;
    const std::string text = refusal(bowl, Flattening::low);
    EXPECT_NE(text.find("divided out; use plane, or a part of the picture"), std::string::npos) << text;
    EXPECT_EQ(refusal(bowl, Flattening::plane), "");
}

TEST(LightTrend, SaysWhatItLeaves) {
    std::mt19937 random(2);
    std::normal_distribution<float> normal(0.0F, 0.1F);
    Image image({64, 64}, 3);  // a slope, a bowl, noise on a slope
    for (int r = 0; r < 64; ++r)
        for (int c = 0; c < 64; ++c) {
            image.at(0, r, c) = 0.2F + 0.003F * static_cast<float>(c);
            image.at(1, r, c) = 3.0F + 0.001F * static_cast<float>(r * r - c);
            image.at(2, r, c) = normal(random) + 0.01F * static_cast<float>(c);
        }
    const FlattenedPicture plane = flattened(image, Flattening::plane),
                           low = flattened(image, Flattening::low);
    const auto constant = [](std::span<const float> values) {
        return std::ranges::all_of(values, [&](float v) { return v == values.front(); });
    };
    EXPECT_EQ(plane.left[0], 0.0);
    EXPECT_TRUE(constant(plane.image.plane(0)));
    EXPECT_NEAR(plane.image.plane(0).front(), 0.2 + 0.003 * 31.5, 1e-6);
    EXPECT_GT(plane.left[1], 0.01);
    EXPECT_EQ(low.left[1], 0.0);
    // 0.1² of that and of (0.01 · 64)² / 12
    EXPECT_NEAR(plane.left[2], 0.01 / (0.01 + 0.4096 / 12.0), 0.02);
    Image slope({64, 64}, 1);
    std::ranges::copy(image.plane(0), slope.plane(0).begin());
    EXPECT_THROW((void)flattened(slope, Flattening::plane), InputError);
    // Of a constant picture nothing is taken: who models it refuses it.
    EXPECT_EQ(flattened(Image({64, 64}, 1), Flattening::plane).left.front(), 1.0);
}

}  // namespace
}  // namespace btfield
