// Types that files get, and what is told of values that they cannot hold.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "tests/picture_files.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using test::sample;
using test::sampled;
using test::TemporaryFolder;

TEST(written_values, type_follows_extension_and_source) {
    const TemporaryFolder folder;
    const Image image = sampled({5, 9}, 3, ColourSpace::srgb, PixelType::uint8);
    const auto type = [&](const char* file, PixelType source) {
        write_picture(folder / file, image, source);
        return read_picture(folder / file).type;
    };
    using enum PixelType;
    for (const auto source : {uint8, uint16, half, float32}) {
        EXPECT_EQ(type("a.exr", source), source == uint8 || source == half ? half : float32);
        EXPECT_EQ(type("a.hdr", source), float32);
        EXPECT_EQ(type("a.tif", source), source);
        EXPECT_EQ(type("a.jpg", source), uint8);
        EXPECT_EQ(type("a.png", source), source == uint8 ? uint8 : uint16);
        EXPECT_EQ(type("a.ppm", source), source == uint8 ? uint8 : uint16);
    }
}

TEST(written_values, integers_round_to_the_nearest_and_clamp) {
    const TemporaryFolder folder;
    Image image({1, 8}, 1);
    const std::array<float, 8> values{0.0F,         1.0F,         0.49F / 255, 0.51F / 255,
                                      100.4F / 255, 100.6F / 255, -7.0F,       1e9F};
    std::copy(values.begin(), values.end(), image.values().begin());
    EXPECT_EQ(write_picture(folder / "a.png", image).clamped_pixels, 2U);
    const Picture read = read_picture(folder / "a.png");
    const std::array<float, 8> expected{0, 255, 0, 1, 100, 101, 0, 255};
    for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(read.image.values()[i], expected.at(i) / 255.0F);

    EXPECT_EQ(write_picture(folder / "b.png", image, PixelType::uint16).clamped_pixels, 2U);
    EXPECT_EQ(read_picture(folder / "b.png").image.values()[7], 1.0F);
    EXPECT_EQ(read_picture(folder / "b.png").image.values()[6], 0.0F);
}

TEST(written_values, clamped_pixels_not_values_are_counted) {
    const TemporaryFolder folder;
    Image image({2, 3}, 3, ColourSpace::srgb);
    image.at(0, 0, 0) = -0.1F;
    image.at(1, 0, 0) = 1.1F;  // the same pixel
    image.at(2, 1, 2) = std::nextafter(1.0F, 2.0F);
    image.at(1, 1, 0) = 1.0F;  // the edges belong to the range
    EXPECT_EQ(write_picture(folder / "a.png", image).clamped_pixels, 2U);
    EXPECT_EQ(write_picture(folder / "a.jpg", image).clamped_pixels, 2U);
    EXPECT_EQ(write_picture(folder / "a.tif", image, PixelType::uint16).clamped_pixels, 2U);
    EXPECT_EQ(write_picture(folder / "a.tif", image, PixelType::float32).clamped_pixels, 0U);
    EXPECT_EQ(write_picture(folder / "a.exr", image).clamped_pixels, 0U);
    // RGBE has no sign.
    EXPECT_EQ(write_picture(folder / "a.hdr", image).clamped_pixels, 1U);
    EXPECT_EQ(read_picture(folder / "a.hdr").image.at(0, 0, 0), 0.0F);
}

TEST(written_values, pixel_type_names_round_trip) {
    for (const auto type : {PixelType::uint8, PixelType::uint16, PixelType::half, PixelType::float32}) {
        EXPECT_EQ(pixel_type(name(type)), type);
    }
    EXPECT_EQ(name(PixelType::float32), "float");
    EXPECT_EQ(bytes_per_value(PixelType::uint8), 1);
    EXPECT_EQ(bytes_per_value(PixelType::uint16), 2);
    EXPECT_EQ(bytes_per_value(PixelType::half), 2);
    EXPECT_EQ(bytes_per_value(PixelType::float32), 4);
    EXPECT_THROW(static_cast<void>(pixel_type("double")), InputError);
}

TEST(written_values, counts_no_clamping_where_the_picture_itself_was_cut_off) {
    const test::TemporaryFolder folder;
    Image image({2, 2}, 3);
    image.at(0, 0, 0) = 1.5F;
    image.at(1, 1, 0) = -0.5F;
    image.at(2, 1, 1) = 2.0F;
    WriteOptions options;
    EXPECT_EQ(write_picture(folder / "a.png", image, options).clamped_pixels, 3U);
    options.limits = {{false, true}, {false, true}, {}};
    EXPECT_EQ(write_picture(folder / "a.png", image, options).clamped_pixels, 2U);
    options.limits = {{false, true}, {true, false}, {true, true}};
    EXPECT_EQ(write_picture(folder / "a.png", image, options).clamped_pixels, 0U);
    EXPECT_EQ(plane_limits(read_picture(folder / "a.png").image),
              (std::vector<PlaneLimits>{{true, true}, {true, false}, {true, true}}));
    options.limits.pop_back();
    EXPECT_THROW((void)write_picture(folder / "b.png", image, options), InputError);
}

TEST(written_values, three_planes_with_names_of_their_own_are_told_where_they_become_colours) {
    const test::TemporaryFolder folder;
    Image image({4, 4}, 3);
    std::ranges::fill(image.values(), 0.5F);
    const auto remarks = [&](const char* name) { return write_picture(folder / name, image).remarks; };
    EXPECT_TRUE(remarks("plain.png").empty());
    image.set_names({"height", "rough", "metal"});
    for (const char* name : {"a.png", "a.jpg", "a.ppm", "a.hdr"}) {
        ASSERT_EQ(remarks(name).size(), 1U) << name;
        EXPECT_NE(remarks(name)[0].find("'height', 'rough' and 'metal' are no colours"), std::string::npos);
    }
    for (const char* name : {"a.tif", "a.exr"}) EXPECT_TRUE(remarks(name).empty()) << name;
    EXPECT_EQ(read_picture(folder / "a.ppm").image.space(), ColourSpace::srgb);
    image.set_space(ColourSpace::srgb);
    EXPECT_TRUE(remarks("colours.png").empty());
}

}  // namespace
}  // namespace btfield
