// host/relief/relief.cpp, light_stack.cpp and rule_choice.cpp.

#include "btfield/relief.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "tests/device_cases.hpp"
#include "tests/light_cases.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

constexpr Size size{30, 44};

class ReliefOfFiles : public testing::Test {
  protected:
    Relief fit(const std::string& folder, const ReliefOptions& options = {}, bool maps = false) {
        return fit_relief(test::default_device(), read_light_set(folder_ / folder), options, maps);
    }
    void refused(const std::string& folder, const ReliefOptions& options, const std::string& part) {
        try {
            static_cast<void>(fit(folder, options));
            ADD_FAILURE() << "accepted";
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
        }
    }
    TemporaryFolder folder_;
};

TEST_F(ReliefOfFiles, EveryTypeOfPicture) {
    const Image truth = test::hilly_normals(size);
    for (const auto& [type, extension, bound] :
         {std::tuple{PixelType::uint8, ".png", 0.5}, std::tuple{PixelType::uint16, ".png", 0.06},
          std::tuple{PixelType::float32, ".exr", 0.06}}) {
        SCOPED_TRACE(name(type));
        const std::string folder = std::string(name(type));
        test::put_lights(folder_ / folder, size, 24, 3, type, extension);
        const Relief relief = fit(folder);
        EXPECT_EQ(relief.lights, 24);
        EXPECT_EQ(relief.coding, LightCoding::linear);
        EXPECT_EQ(relief.type, type);
        EXPECT_TRUE(relief.remarks.empty());
        // Half a step of 8 bits is a hundredth of the dark values.
        EXPECT_LE(test::mean_angle(relief.normals, truth), bound);
        EXPECT_EQ(relief.albedo.planes(), 3);
        EXPECT_NEAR(relief.albedo.at(2, 7, 9), test::albedo_at(2, 7, 9), 0.01F);
        EXPECT_LE(relief.left_out_error, 0.01);
        EXPECT_EQ(relief.saturated, 0.0);
    }
}

TEST_F(ReliefOfFiles, TheCodingIsFound) {
    const Image truth = test::hilly_normals(size);
    const std::vector<test::Direction> lights =
        test::put_lights(folder_ / "srgb", size, 12, 1, PixelType::uint8, ".png");
    for (std::size_t k = 0; k < lights.size(); ++k) {
        Image image = test::lit(truth, 1, {.direction = lights[k]}, static_cast<unsigned>(k));
        for (float& value : image.values())
            value = value <= 0.0031308F ? 12.92F * value : 1.055F * std::pow(value, 1.0F / 2.4F) - 0.055F;
        WriteOptions how;
        how.keep_values = true;
        write_picture(folder_ / ("srgb/light " + std::to_string(k) + ".png"), image, how);
    }
    const Relief found = fit("srgb");
    EXPECT_EQ(found.coding, LightCoding::srgb);
    EXPECT_LE(test::mean_angle(found.normals, truth), 0.6);
    ReliefOptions options;
    options.coding = LightCoding::linear;
    const Relief wrong = fit("srgb", options);
    ASSERT_EQ(wrong.remarks.size(), 1U);
    EXPECT_NE(wrong.remarks[0].find("sRGB-encoded"), std::string::npos);
    EXPECT_GE(test::mean_angle(wrong.normals, truth), 3.0 * test::mean_angle(found.normals, truth));
    options.coding = LightCoding::gamma;
    options.gamma = 2.2;
    EXPECT_LE(test::mean_angle(fit("srgb", options).normals, truth), 1.5);
}

TEST_F(ReliefOfFiles, EightBitsOfABtfAreEncoded) {
    const std::vector<test::Direction> lights =
        test::put_lights(folder_ / "made", size, 8, 1, PixelType::uint8, ".png");
    for (std::size_t k = 0; k < lights.size(); ++k) {
        const double theta = std::acos(lights[k][2]) * 180.0 / std::numbers::pi;
        const double phi = std::atan2(lights[k][1], lights[k][0]) * 180.0 / std::numbers::pi;
        const std::string name =
            "tl" + std::to_string(theta) + "_pl" + std::to_string(phi < 0.0 ? phi + 360.0 : phi);
        fs::create_directories(folder_ / "btf");
        fs::copy_file(folder_ / ("made/light " + std::to_string(k) + ".png"),
                      folder_ / ("btf/" + name + "_tv000_pv000.png"));
    }
    const Relief relief = fit("btf");
    EXPECT_EQ(relief.coding, LightCoding::srgb);
    EXPECT_TRUE(relief.remarks.empty());
    ReliefOptions options;
    options.coding = LightCoding::linear;  // what they are here
    EXPECT_LE(test::mean_angle(fit("btf", options).normals, test::hilly_normals(size)), 0.6);
}

TEST_F(ReliefOfFiles, StripsGiveTheSameNumbers) {
    test::put_lights(folder_ / "stack", size, 20, 1, PixelType::uint8, ".png", {.noise = 0.02F});
    ReliefOptions options;
    options.rule = LightRule::huber;
    const Relief whole = fit("stack", options, true);
    DeviceOptions small;
    small.memory_bytes = 100000;  // a stack takes as much
    Device device({}, small);
    const Relief strips = fit_relief(device, read_light_set(folder_ / "stack"), options, true);
    const auto expect_same = [](const Image& a, const Image& b) {
        EXPECT_TRUE(std::ranges::equal(a.values(), b.values()));
    };
    expect_same(whole.normals, strips.normals);
    expect_same(whole.albedo, strips.albedo);
    expect_same(whole.residual, strips.residual);
    expect_same(whole.left_out, strips.left_out);
    EXPECT_EQ(whole.left_out_error, strips.left_out_error);
}

TEST_F(ReliefOfFiles, CropsAndMasks) {
    test::put_lights(folder_ / "stack", size, 16, 1, PixelType::uint16, ".png");
    ReliefOptions options;
    options.rule = LightRule::ls;
    const Relief whole = fit("stack", options);
    options.crop = Crop{5, 3, 20, 10};
    const Relief part = fit("stack", options);
    ASSERT_EQ(part.normals.size(), (Size{10, 20}));
    EXPECT_EQ(part.normals.at(0, 2, 4), whole.normals.at(0, 5, 9));
    options.crop.reset();
    Image mask(size, 1);
    for (int c = 10; c < 20; ++c) mask.at(0, 6, c) = 1.0F;
    write_picture(folder_ / "mask.png", mask);
    options.mask = folder_ / "mask.png";
    const Relief masked = fit("stack", options);
    EXPECT_EQ(std::ranges::count(masked.inside, 1), 10);
    EXPECT_EQ(masked.normals.at(0, 6, 12), whole.normals.at(0, 6, 12));
    EXPECT_EQ(masked.normals.at(2, 7, 12), 1.0F);
    EXPECT_EQ(masked.albedo.at(0, 7, 12), 0.0F);
    write_picture(folder_ / "mask.png", Image({5, 5}, 1));
    refused("stack", options, "give a mask of their size");
    write_picture(folder_ / "mask.png", Image(size, 1));
    refused("stack", options, "leaves no pixel");
    options.ignore_mask = true;
    EXPECT_TRUE(fit("stack", options).inside.empty());
}

TEST_F(ReliefOfFiles, IntensitiesAreDividedBy) {
    const std::vector<test::Direction> lights =
        test::put_lights(folder_ / "stack", size, 8, 3, PixelType::float32, ".exr");
    LightSet set = read_light_set(folder_ / "stack");
    const Relief before = fit("stack");
    for (std::size_t k = 0; k < set.lights.size(); ++k) {
        const std::vector<double> intensity{1.0 + 0.1 * static_cast<double>(k), 2.0, 0.5};
        Picture picture = read_picture(set.lights[k].picture);
        for (int p = 0; p < 3; ++p)
            for (float& value : picture.image.plane(p))
                value *= static_cast<float>(intensity[static_cast<std::size_t>(p)]);
        write_picture(set.lights[k].picture, picture.image, PixelType::float32);
        set.lights[k].intensity = intensity;
    }
    const Relief after = fit_relief(test::default_device(), set);
    EXPECT_LE(test::mean_angle(before.normals, after.normals), 0.01);
    EXPECT_NEAR(after.albedo.at(1, 8, 8), before.albedo.at(1, 8, 8), 1e-4F);
    set.lights[3].intensity = {1.0, 2.0};
    EXPECT_THROW((void)fit_relief(test::default_device(), set), InputError);
}

TEST_F(ReliefOfFiles, PicturesThatDoNotFit) {
    test::put_lights(folder_ / "stack", size, 8, 1, PixelType::uint8, ".png");
    const fs::path third = folder_ / "stack/light 3.png";
    const Image image({8, 8}, 1), colour(size, 3);
    write_picture(third, image);
    refused("stack", {}, "give pictures of one size");
    write_picture(third, colour);
    refused("stack", {}, "give pictures of one kind");
    test::put_bytes(third, "no picture");
    refused("stack", {}, "light 3.png");
    ReliefOptions options;
    options.low = 0.9;
    refused("stack", options, "ranks");
    options = {};
    options.roughness = 2.0;
    refused("stack", options, "roughness");
}

TEST(Relief, OfPicturesInMemory) {
    const Image truth = test::hilly_normals(size);
    const std::vector<test::Direction> lights = test::dome(24);
    std::vector<Image> pictures;
    for (std::size_t k = 0; k < lights.size(); ++k)
        pictures.push_back(test::lit(truth, 1, {.direction = lights[k], .noise = 0.01F, .shadows = 0.1F},
                                     static_cast<unsigned>(k)));
    Device& device = test::default_device();
    const Relief relief = fit_relief(device, pictures, lights);
    EXPECT_LE(test::mean_angle(relief.normals, truth), 1.0);
    EXPECT_NEAR(relief.shadowed, 0.1, 0.02);
    EXPECT_LT(relief.left_out_error, relief.left_out_least_squares);
    // Whatever was chosen, the same again, to the bit.
    const Relief again = fit_relief(device, pictures, lights);
    EXPECT_TRUE(std::ranges::equal(relief.normals.values(), again.normals.values()));
    EXPECT_EQ(relief.rule, again.rule);

    EXPECT_THROW((void)fit_relief(device, std::span(pictures).first(2), std::span(lights).first(2)),
                 InputError);
    EXPECT_THROW((void)fit_relief(device, pictures, std::span(lights).first(23)), InputError);
    std::vector<test::Direction> behind = lights;
    behind[4][2] = -0.5;
    EXPECT_THROW((void)fit_relief(device, pictures, behind), InputError);
    pictures[2].at(0, 1, 1) = std::numeric_limits<float>::quiet_NaN();
    EXPECT_THROW((void)fit_relief(device, pictures, lights), InputError);
}

std::vector<Image> pictures_under(const std::vector<test::Direction>& lights, test::Light like) {
    const Image truth = test::hilly_normals(size);
    std::vector<Image> pictures;
    for (std::size_t k = 0; k < lights.size(); ++k) {
        like.direction = lights[k];
        pictures.push_back(test::lit(truth, 1, like, static_cast<unsigned>(k)));
    }
    return pictures;
}

TEST(Relief, TooFewLightsToJudgeAreHubers) {
    for (const int count : {3, 5}) {
        const std::vector<test::Direction> lights = test::dome(count);
        const Relief relief = fit_relief(test::default_device(), pictures_under(lights, {}), lights);
        EXPECT_EQ(relief.rule, LightRule::huber);
        EXPECT_TRUE(std::isnan(relief.left_out_error));
        EXPECT_LE(test::mean_angle(relief.normals, test::hilly_normals(size)), 0.1) << count;
    }
}

TEST(Relief, FewLightsAreJudgedToo) {
    const std::vector<test::Direction> lights = test::dome(12);
    const std::vector<Image> pictures =
        pictures_under(lights, {.ambient = 0.3F, .noise = 0.01F, .shadows = 0.05F});
    const Relief relief = fit_relief(test::default_device(), pictures, lights);
    EXPECT_EQ(relief.rule, LightRule::amb);
    EXPECT_LE(relief.left_out_error, relief.left_out_least_squares);
    ReliefOptions options;
    options.rule = LightRule::huber;
    const Relief huber = fit_relief(test::default_device(), pictures, lights, options);
    const Image truth = test::hilly_normals(size);
    EXPECT_LE(test::mean_angle(relief.normals, truth), 0.9 * test::mean_angle(huber.normals, truth));
}

TEST(Relief, LightsOnAnArcButForOneAreJudged) {
    // Without the part that has the first light the others lie in one plane: that part tells nothing.
    std::vector<test::Direction> lights{{0.0, 0.5, std::sqrt(0.75)}};
    for (int k = 1; k < 7; ++k) {
        const double turn = (k - 3.5) * 0.3;
        lights.push_back({std::sin(turn), 0.0, std::cos(turn)});
    }
    const Relief relief =
        fit_relief(test::default_device(), pictures_under(lights, {.noise = 0.01F}), lights);
    EXPECT_TRUE(std::isfinite(relief.left_out_error));
    EXPECT_LE(relief.left_out_error, 0.1);
    EXPECT_LE(relief.left_out_error, 1.05 * relief.left_out_least_squares);
}

}  // namespace
}  // namespace btfield
