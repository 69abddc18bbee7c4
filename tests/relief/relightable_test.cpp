#include "btfield/relightable.hpp"

#include <gtest/gtest.h>

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

/// A polynomial of the light for each pixel and plane, well inside of [0, 1] for all lights.
double shown(int p, int r, int c, const Direction& l) {
    const double a = 0.01 * ((r + 2 * c + p) % 7);
    return 0.4 + a + (0.1 + a) * l[0] - (0.05 - a) * l[1] + 0.03 * l[0] * l[0] - 0.04 * l[0] * l[1] +
           0.05 * l[1] * l[1];
}

double linear_of(double value) {
    return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

/// Pictures of that as files of linear light.
LightSet put_polynomials(const test::TemporaryFolder& folder, const std::vector<Direction>& lights,
                         int planes, PixelType type, double intensity) {
    LightSet set;
    for (std::size_t k = 0; k < lights.size(); ++k) {
        Image image({9, 13}, planes);
        for (int p = 0; p < planes; ++p)
            for (int r = 0; r < 9; ++r)
                for (int c = 0; c < 13; ++c)
                    image.at(p, r, c) = static_cast<float>(intensity * linear_of(shown(p, r, c, lights[k])));
        WriteOptions how;
        how.source = how.type.emplace(type);
        how.keep_values = true;
        const auto name = folder / (std::to_string(k) + (type == PixelType::float32 ? ".exr" : ".png"));
        write_picture(name, image, how);
        LightPicture& light = set.lights.emplace_back();
        light.picture = name;
        light.direction = lights[k];
        if (intensity != 1.0) light.intensity = {intensity};
    }
    return set;
}

ReliefOptions linear() {
    ReliefOptions options;
    options.coding = LightCoding::linear;
    return options;
}

TEST(Relightable, FindsAPolynomial) {
    const test::TemporaryFolder folder;
    const LightSet set = put_polynomials(folder, test::dome(17), 3, PixelType::uint16, 1.0);
    const LightPolynomial found = fit_light_polynomial(test::default_device(), set, linear());
    EXPECT_EQ(found.planes, 3);
    EXPECT_EQ(found.coefficients.planes(), 18);
    EXPECT_EQ(found.white, 1.0);
    EXPECT_TRUE(found.remarks.empty());
    // Steps of 16 bits in linear light, and of the table that encodes it.
    EXPECT_LT(found.error, 1e-4);
    const Direction light{-2.0, 1.0, 3.0};  // not among them, of any length
    Direction unit = light;
    for (double& x : unit) x /= std::sqrt(14.0);
    const Image relit = relight(found, light);
    EXPECT_EQ(relit.space(), ColourSpace::srgb);
    for (int p = 0; p < 3; ++p)
        for (int r = 0; r < 9; ++r)
            for (int c = 0; c < 13; ++c) ASSERT_NEAR(relit.at(p, r, c), shown(p, r, c, unit), 5e-4);
    // The crop of it is the crop.
    ReliefOptions options = linear();
    options.crop = Crop{4, 2, 5, 6};
    const Image part = relight(fit_light_polynomial(test::default_device(), set, options), light);
    EXPECT_EQ(part.size(), (Size{6, 5}));
    EXPECT_NEAR(part.at(1, 0, 0), relit.at(1, 2, 4), 1e-6F);
}

TEST(Relightable, WhiteFollowsFloatsAndIntensities) {
    const test::TemporaryFolder folder;
    const LightSet set = put_polynomials(folder, test::dome(12), 1, PixelType::float32, 6.0);
    const LightPolynomial found = fit_light_polynomial(test::default_device(), set, linear());
    // The brightest of all, in the unit of a light of intensity 1.
    EXPECT_GT(found.white, linear_of(0.45));
    EXPECT_LT(found.white, linear_of(0.66));
    EXPECT_LT(found.error, 0.01);
    const Direction light = test::dome(12)[3];
    const Image relit = relight(found, light);
    EXPECT_EQ(relit.space(), ColourSpace::unspecified);
    EXPECT_NEAR(linear_of(static_cast<double>(relit.at(0, 4, 5))) * found.white,
                linear_of(shown(0, 4, 5, light)), 0.02);
}

TEST(Relightable, PlanesHoldCoefficients) {
    const test::TemporaryFolder folder;
    for (const int planes : {1, 3}) {
        const LightSet set = put_polynomials(folder, test::dome(14), planes, PixelType::uint16, 1.0);
        const LightPolynomial found = fit_light_polynomial(test::default_device(), set, linear());
        const RelightablePlanes made = relightable_planes(found);
        ASSERT_EQ(made.pictures.size(), 6U);
        ASSERT_EQ(made.scale.size(), 18U);
        ASSERT_EQ(made.bias.size(), 18U);
        for (int t = 0; t < 6; ++t)
            for (int p = 0; p < 3; ++p) {
                const auto k = static_cast<std::size_t>(3 * t + p);
                const auto coded = made.pictures[static_cast<std::size_t>(t)].plane(p);
                const auto value = found.coefficients.plane(t * planes + std::min(p, planes - 1));
                for (std::size_t i = 0; i < value.size(); ++i) {
                    ASSERT_GE(coded[i], 0.0F);
                    ASSERT_LE(coded[i], 1.0F);
                    ASSERT_NEAR((static_cast<double>(coded[i]) - made.bias[k]) * made.scale[k], value[i],
                                1e-5);
                }
            }
    }
}

TEST(Relightable, LightsThatTellTooLittle) {
    const test::TemporaryFolder folder;
    std::vector<Direction> ring;
    for (int k = 0; k < 8; ++k)
        ring.push_back(
            {0.6 * std::cos(k * std::numbers::pi / 4), 0.6 * std::sin(k * std::numbers::pi / 4), 0.8});
    const LightSet set = put_polynomials(folder, ring, 1, PixelType::uint16, 1.0);
    const LightPolynomial found = fit_light_polynomial(test::default_device(), set, linear());
    ASSERT_EQ(found.remarks.size(), 1U);
    EXPECT_NE(found.remarks.front().find("on a ring"), std::string::npos);
    EXPECT_LT(found.error, 1e-3);  // under these lights all is told
    for (const float value : found.coefficients.values()) ASSERT_LT(std::abs(value), 1.0F);

    LightSet few = set;
    few.lights.resize(5);
    EXPECT_THROW(static_cast<void>(fit_light_polynomial(test::default_device(), few, linear())), InputError);
    EXPECT_THROW(static_cast<void>(relight(found, {1.0, 0.0, 0.0})), InputError);
    LightPolynomial spectral = found;
    spectral.planes = 2;
    EXPECT_THROW(static_cast<void>(relightable_planes(spectral)), InputError);
}

}  // namespace
}  // namespace btfield
