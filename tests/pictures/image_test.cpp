#include "btfield/image.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>

#include "btfield/error.hpp"

namespace btfield {
namespace {

constexpr int most = std::numeric_limits<int>::max();

/// Every value differs: plane, row and column can be read off it.
Image numbered(Size size, int planes) {
    Image image(size, planes);
    for (int p = 0; p < planes; ++p) {
        for (int r = 0; r < size.height; ++r) {
            for (int c = 0; c < size.width; ++c)
                image.at(p, r, c) = static_cast<float>(10000 * p + 100 * r + c);
        }
    }
    return image;
}

std::string message(auto&& action) {
    try {
        action();
    } catch (const InputError& error) {
        return error.what();
    }
    return "no error";
}

TEST(image, starts_at_zero) {
    const Image image({3, 5}, 2, ColourSpace::linear);
    EXPECT_EQ(image.size(), (Size{3, 5}));
    EXPECT_EQ(image.planes(), 2);
    EXPECT_EQ(image.space(), ColourSpace::linear);
    ASSERT_EQ(image.values().size(), 30U);
    EXPECT_TRUE(std::all_of(image.values().begin(), image.values().end(), [](float v) { return v == 0.0F; }));
}

TEST(image, is_planar_and_row_major) {
    const Image image = numbered({3, 5}, 2);
    EXPECT_EQ(image.values()[(1 * 3 + 2) * 5 + 4], 10204.0F);
    EXPECT_EQ(image.plane(1)[2 * 5 + 4], 10204.0F);
    EXPECT_EQ(image.plane(1).size(), 15U);
}

TEST(image, refuses_impossible_shapes) {
    for (const Size size : {Size{0, 4}, Size{4, 0}, Size{-1, 4}, Size{4, -1}, Size{-3, -3}}) {
        EXPECT_NE(message([&] { Image(size, 1); }).find("a side is less than 1"), std::string::npos);
    }
    EXPECT_EQ(message([] {
                  Image({4, 3}, 0);
              }),
              "make a picture of 3x4 pixels and 0 planes: there is no plane; give at least one plane");
    EXPECT_THROW(Image({4, 3}, -1), InputError);
    // 2^31 · 2^31 · 2^31 · 4 bytes wrap around in 64 bits.
    EXPECT_NE(message([] {
                  Image({most, most}, most);
              }).find("more than memory can address"),
              std::string::npos);
    EXPECT_THROW(Image({most, most}, 2), InputError);
}

TEST(image, crop_copies_the_rectangle) {
    Image image = numbered({4, 6}, 3);
    image.set_space(ColourSpace::xyz);
    const Image part = image.crop(1, 2, {3, 4});
    EXPECT_EQ(part.size(), (Size{3, 4}));
    EXPECT_EQ(part.planes(), 3);
    EXPECT_EQ(part.space(), ColourSpace::xyz);
    for (int p = 0; p < 3; ++p) {
        for (int r = 0; r < 3; ++r) {
            for (int c = 0; c < 4; ++c) EXPECT_EQ(part.at(p, r, c), image.at(p, r + 1, c + 2));
        }
    }
    const Image whole = image.crop(0, 0, image.size());
    EXPECT_TRUE(std::equal(whole.values().begin(), whole.values().end(), image.values().begin()));
}

TEST(image, crop_stays_inside) {
    const Image image = numbered({4, 6}, 1);
    const auto crop = [&](int row, int column, Size size) {
        static_cast<void>(image.crop(row, column, size));
    };
    EXPECT_NO_THROW(crop(3, 5, {1, 1}));
    EXPECT_THROW(crop(-1, 0, {1, 1}), InputError);
    EXPECT_THROW(crop(0, -1, {1, 1}), InputError);
    EXPECT_THROW(crop(4, 0, {1, 1}), InputError);
    EXPECT_THROW(crop(0, 6, {1, 1}), InputError);
    EXPECT_THROW(crop(1, 0, {4, 1}), InputError);
    EXPECT_THROW(crop(0, 1, {1, 6}), InputError);
    EXPECT_THROW(crop(0, 0, {0, 1}), InputError);
    EXPECT_THROW(crop(0, 0, {1, -1}), InputError);
    EXPECT_THROW(crop(1, 1, {most, most}), InputError);
    EXPECT_THROW(static_cast<void>(Image().crop(0, 0, {1, 1})), InputError);
    EXPECT_EQ(message([&] {
                  crop(1, 2, {4, 3});
              }),
              "crop 3x4 pixels at column 2, row 1: the picture has 6x4 pixels; give a rectangle of at least "
              "one pixel "
              "inside the picture");
}

TEST(image, colour_space_names_round_trip) {
    for (const auto space :
         {ColourSpace::unspecified, ColourSpace::srgb, ColourSpace::linear, ColourSpace::xyz}) {
        EXPECT_EQ(colour_space(name(space)), space);
    }
    EXPECT_EQ(name(ColourSpace::xyz), "xyz");
    EXPECT_EQ(message([] { static_cast<void>(colour_space("sRGB")); }),
              "find a colour space: 'sRGB' is not known; use unspecified, srgb, linear or xyz");
}

TEST(Image, WindowsWrap) {
    Image image({3, 5}, 2, ColourSpace::linear);
    for (int p = 0; p < 2; ++p)
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 5; ++c) image.at(p, r, c) = static_cast<float>(100 * p + 10 * r + c);
    for (const auto& [row, column] :
         {std::pair{0, 0}, {2, 4}, {-1, -7}, {300, 1}, {-2147483647, 2147483647}}) {
        const Image part = image.window(row, column, {4, 12});
        EXPECT_EQ(part.space(), ColourSpace::linear);
        for (int p = 0; p < 2; ++p)
            for (int r = 0; r < 4; ++r)
                for (int c = 0; c < 12; ++c) {
                    const long long i = (static_cast<long long>(row) + r) % 3,
                                    j = (static_cast<long long>(column) + c) % 5;
                    ASSERT_EQ(part.at(p, r, c),
                              image.at(p, static_cast<int>((i + 3) % 3), static_cast<int>((j + 5) % 5)));
                }
    }
    EXPECT_THROW((void)image.window(0, 0, {0, 3}), InputError);
    EXPECT_THROW((void)Image().window(0, 0, {2, 3}), InputError);
}

}  // namespace
}  // namespace btfield
