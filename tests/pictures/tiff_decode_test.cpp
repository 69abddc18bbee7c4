// TIFF of every kind, put together byte by byte.

#include <gtest/gtest.h>
#include <tiffio.h>

#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/pictures/colour.hpp"
#include "tests/picture_bytes.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using test::little_endian;
using test::put_bytes;
using test::TemporaryFolder;
using test::tiff_bytes;
using test::TiffTag;

constexpr std::uint16_t bits_tag = 258, photometric = 262, samples_tag = 277, orientation = 274,
                        map_tag = 320, extra = 338, format_tag = 339, ink_set = 332;
constexpr std::uint16_t white_is_zero = 0, black_is_zero = 1, rgb = 2, palette = 3, separated = 5, cielab = 8;

class TiffDecode : public testing::Test {
  protected:
    Picture read(Size size, const std::vector<TiffTag>& tags, const std::string& pixels,
                 const ReadOptions& options = {}) {
        put_bytes(folder_ / "a.tif", tiff_bytes(size, tags, pixels));
        return read_picture(folder_ / "a.tif", options);
    }
    std::vector<float> values(Size size, const std::vector<TiffTag>& tags, const std::string& pixels,
                              const ReadOptions& options = {}) {
        const Picture picture = read(size, tags, pixels, options);
        return {picture.image.values().begin(), picture.image.values().end()};
    }
    std::string refusal(Size size, const std::vector<TiffTag>& tags, const std::string& pixels) {
        testing::internal::CaptureStderr();
        std::string message = "read";
        try {
            static_cast<void>(read(size, tags, pixels));
        } catch (const InputError& error) {
            message = error.what();
        }
        EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
        return message;
    }
    TemporaryFolder folder_;
};

std::string floats(const std::vector<float>& values) {
    std::string bytes(4 * values.size(), '\0');
    std::memcpy(bytes.data(), values.data(), bytes.size());
    return bytes;
}

TEST_F(TiffDecode, GreyOfEveryDepthEitherWayRound) {
    struct {
        std::uint16_t bits;
        std::string pixels;
        std::vector<float> dark_is_zero;
    } const cases[] = {
        {1, "\xa0", {1, 0, 1}},
        {2, "\x18", {0, 1.0F / 3, 2.0F / 3}},
        {4, std::string("\x0f\x80", 2), {0, 1, 8.0F / 15}},
        {8, std::string("\0\x33\xff", 3), {0, 51.0F / 255, 1}},
        {12, std::string("\0\x0f\xff\x80\0", 5), {0, 1, 2048.0F / 4095}},
        {16,
         little_endian(0, 2) + little_endian(13107, 2) + little_endian(65535, 2),
         {0, 13107.0F / 65535, 1}},
    };
    for (const auto& c : cases) {
        EXPECT_EQ(values({1, 3}, {{bits_tag, {c.bits}}, {photometric, {black_is_zero}}}, c.pixels),
                  c.dark_is_zero)
            << c.bits;
        std::vector<float> inverted = c.dark_is_zero;
        for (float& v : inverted) v = 1.0F - v;
        EXPECT_EQ(values({1, 3}, {{bits_tag, {c.bits}}, {photometric, {white_is_zero}}}, c.pixels), inverted)
            << c.bits;
        EXPECT_EQ(values({1, 3}, {{bits_tag, {c.bits}}, {photometric, {white_is_zero}}}, c.pixels,
                         {{}, {}, {}, true}),
                  c.dark_is_zero)
            << "values kept, " << c.bits;
    }
    const Picture picture = read(
        {1, 2}, {{bits_tag, {32}}, {photometric, {white_is_zero}}, {format_tag, {3}}}, floats({0.25F, 1.0F}));
    EXPECT_EQ(picture.image.at(0, 0, 0), 0.75F);
    ASSERT_EQ(picture.remarks.size(), 1U);
}

TEST_F(TiffDecode, IntegersWithAUnitKeepIt) {
    const std::vector<TiffTag> wide{{bits_tag, {32}}, {photometric, {black_is_zero}}};
    Picture picture = read({1, 2}, wide, little_endian(7) + little_endian(16777216));
    EXPECT_EQ(picture.image.at(0, 0, 0), 7.0F);
    EXPECT_EQ(picture.image.at(0, 0, 1), 16777216.0F);
    EXPECT_EQ(picture.type, PixelType::float32);
    EXPECT_TRUE(picture.remarks.empty());
    picture = read({1, 1}, wide, little_endian(16777217));
    ASSERT_EQ(picture.remarks.size(), 1U);
    EXPECT_NE(picture.remarks[0].find("16777216"), std::string::npos);
    EXPECT_EQ(values({1, 2}, {{bits_tag, {32}}, {photometric, {white_is_zero}}},
                     little_endian(4294967295U) + little_endian(4294967290U)),
              (std::vector<float>{0, 5}));
    const std::vector<TiffTag> sign{{bits_tag, {16}}, {photometric, {black_is_zero}}, {format_tag, {2}}};
    EXPECT_EQ(values({1, 2}, sign, little_endian(65535, 2) + little_endian(300, 2)),
              (std::vector<float>{-1, 300}));
    const std::vector<TiffTag> small{{bits_tag, {8}}, {photometric, {black_is_zero}}, {format_tag, {2}}};
    EXPECT_EQ(values({1, 2}, small, std::string("\x80\x7f", 2)), (std::vector<float>{-128, 127}));
}

TEST_F(TiffDecode, HalfAndFloat) {
    EXPECT_EQ(values({1, 3}, {{bits_tag, {16}}, {photometric, {black_is_zero}}, {format_tag, {3}}},
                     little_endian(0x3c00, 2) + little_endian(0xc000, 2) + little_endian(0x0001, 2)),
              (std::vector<float>{1.0F, -2.0F, std::ldexp(1.0F, -24)}));
    const Picture picture = read(
        {1, 1}, {{bits_tag, {32, 32, 32}}, {photometric, {rgb}}, {samples_tag, {3}}, {format_tag, {3, 3, 3}}},
        floats({-1.0F, 0.5F, 7.0F}));
    EXPECT_EQ(picture.image.space(), ColourSpace::linear);
    EXPECT_EQ(picture.image.at(2, 0, 0), 7.0F);
}

TEST_F(TiffDecode, PaletteOfEveryWayToStoreIt) {
    const auto map = [](std::uint16_t red, std::uint16_t green, std::uint16_t blue) {
        std::vector<std::uint16_t> all(48, 0);
        all[1] = red;
        all[17] = green;
        all[33] = blue;
        return all;
    };
    for (const auto& colours : {map(257 * 255, 257 * 51, 0), map(256 * 255, 256 * 51, 0), map(255, 51, 0)}) {
        const Picture picture =
            read({1, 2}, {{bits_tag, {4}}, {photometric, {palette}}, {map_tag, colours}}, "\x10");
        ASSERT_EQ(picture.image.planes(), 3);
        EXPECT_EQ(picture.image.space(), ColourSpace::srgb);
        EXPECT_EQ(picture.type, PixelType::uint8);
        EXPECT_EQ(picture.image.at(0, 0, 0), 1.0F);
        EXPECT_EQ(picture.image.at(1, 0, 0), 51.0F / 255.0F);
        EXPECT_EQ(picture.image.at(0, 0, 1), 0.0F);
    }
    EXPECT_EQ(
        read({1, 2}, {{bits_tag, {4}}, {photometric, {palette}}, {map_tag, map(65535, 300, 1)}}, "\x10").type,
        PixelType::uint16);
}

TEST_F(TiffDecode, InksAndLabBecomeRgb) {
    const std::vector<TiffTag> inks{{bits_tag, {8, 8, 8, 8}}, {photometric, {separated}}, {samples_tag, {4}}};
    const Picture picture = read({1, 1}, inks, std::string("\x33\0\xff\x80", 4));
    ASSERT_EQ(picture.image.planes(), 3);
    const float key = 1.0F - 128.0F / 255.0F;
    EXPECT_FLOAT_EQ(picture.image.at(0, 0, 0), 0.8F * key);
    EXPECT_FLOAT_EQ(picture.image.at(1, 0, 0), key);
    EXPECT_FLOAT_EQ(picture.image.at(2, 0, 0), 0.0F);
    ASSERT_EQ(picture.remarks.size(), 1U);
    EXPECT_NE(picture.remarks[0].find("CMYK"), std::string::npos);
    EXPECT_EQ(read({1, 1}, inks, std::string("\x33\0\xff\x80", 4), {{}, {}, {}, true}).image.planes(), 4);

    // L* = 100 is white, L* = 50 is 18.4 % of its light; a* = b* = 0 is grey.
    const std::vector<TiffTag> lab{{bits_tag, {8, 8, 8}}, {photometric, {cielab}}, {samples_tag, {3}}};
    const Picture white = read({1, 2}, lab, std::string("\xff\0\0\x80\0\0", 6));
    EXPECT_EQ(white.image.space(), ColourSpace::srgb);
    for (int p = 0; p < 3; ++p) {
        EXPECT_NEAR(white.image.at(p, 0, 0), 1.0F,
                    2e-3F);  // D50 is rounded to four digits where it is written
        const double light = std::pow((128.0 * 100.0 / 255.0 + 16.0) / 116.0, 3.0);
        EXPECT_NEAR(white.image.at(p, 0, 1), detail::srgb_encoded(light), 2e-3);
    }
    // a* > 0 is red, in two's complement below 0 green.
    EXPECT_GT(read({1, 1}, lab, std::string("\x80\x40\0", 3)).image.at(0, 0, 0), 0.6F);
    EXPECT_LT(read({1, 1}, lab, std::string("\x80\xc0\0", 3)).image.at(0, 0, 0), 0.3F);
}

TEST_F(TiffDecode, YCbCrAndLogLuvBecomeColours) {
    // Y = 128 and neutral chroma, without subsampling.
    const std::vector<TiffTag> ycbcr{
        {bits_tag, {8, 8, 8}}, {photometric, {6}}, {samples_tag, {3}}, {530, {1, 1}}};
    const Picture grey = read({1, 2}, ycbcr, std::string("\x80\x80\x80\xff\x80\x80", 6));
    EXPECT_EQ(grey.image.space(), ColourSpace::srgb);
    for (int p = 0; p < 3; ++p) {
        EXPECT_NEAR(grey.image.at(p, 0, 0), 128.0F / 255.0F, 1.5F / 255.0F);
        EXPECT_NEAR(grey.image.at(p, 0, 1), 1.0F, 1.5F / 255.0F);
    }
    TIFF* const tiff = TIFFOpen((folder_ / "log.tif").c_str(), "w");
    ASSERT_NE(tiff, nullptr);
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 2);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 1);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_SGILOG);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_LOGLUV);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 3);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 32);
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
    TIFFSetField(tiff, TIFFTAG_SGILOGDATAFMT, SGILOGDATAFMT_FLOAT);
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 1);
    std::array<float, 6> xyz{0.5F, 0.6F, 0.4F, 50.0F, 40.0F, 60.0F};
    ASSERT_EQ(TIFFWriteScanline(tiff, xyz.data(), 0, 0), 1);
    TIFFClose(tiff);
    const Picture light = read_picture(folder_ / "log.tif");
    EXPECT_EQ(light.image.space(), ColourSpace::xyz);
    EXPECT_EQ(light.type, PixelType::float32);
    for (int p = 0; p < 3; ++p)
        for (int c = 0; c < 2; ++c) {
            const float stored = xyz.at(static_cast<std::size_t>(3 * c + p));
            EXPECT_NEAR(light.image.at(p, 0, c), stored, 0.02F * stored);  // chroma has 8 bits
        }
}

/// What is written with libtiff, one row of RGB or grey of 8 bits.
std::filesystem::path written(const std::filesystem::path& path, std::vector<std::uint8_t> pixels,
                              int samples, const std::function<void(TIFF*)>& tags) {
    TIFF* const tiff = TIFFOpen(path.c_str(), "w");
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, static_cast<int>(pixels.size()) / samples);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 1);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, samples);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 8);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, samples == 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    tags(tiff);
    TIFFWriteEncodedStrip(tiff, 0, pixels.data(), static_cast<tmsize_t>(pixels.size()));
    TIFFClose(tiff);
    return path;
}

TEST_F(TiffDecode, TransferFunctionIsConverted) {
    std::vector<std::uint16_t> squares, straight, screens;
    for (int i = 0; i < 256; ++i) {
        const double v = i / 255.0;
        squares.push_back(static_cast<std::uint16_t>(std::lround(65535.0 * v * v)));
        straight.push_back(static_cast<std::uint16_t>(257 * i));
        screens.push_back(static_cast<std::uint16_t>(std::lround(65535.0 * detail::srgb_decoded(v))));
    }
    const auto with = [&](std::vector<std::uint16_t>& table, int samples) {
        return written(folder_ / "t.tif", {100, 200, 50}, samples, [&](TIFF* tiff) {
            if (samples == 3)
                TIFFSetField(tiff, TIFFTAG_TRANSFERFUNCTION, table.data(), table.data(), table.data());
            else
                TIFFSetField(tiff, TIFFTAG_TRANSFERFUNCTION, table.data());
        });
    };
    for (const int samples : {3, 1}) {
        const Picture picture = read_picture(with(squares, samples));
        EXPECT_NEAR(picture.image.values()[0], detail::srgb_encoded(std::pow(100 / 255.0, 2.0)), 1e-4);
        ASSERT_EQ(picture.remarks.size(), 1U);
        EXPECT_NE(picture.remarks[0].find("TransferFunction"), std::string::npos);
        EXPECT_EQ(read_picture(with(straight, samples)).image.space(), ColourSpace::linear);
        EXPECT_TRUE(read_picture(with(screens, samples)).remarks.empty());
        EXPECT_EQ(read_picture(with(screens, samples)).image.values()[0], 100.0F / 255.0F);
    }
    EXPECT_EQ(read_picture(folder_ / "t.tif", {{}, {}, {}, true}).image.values()[0], 100.0F / 255.0F);
}

TEST_F(TiffDecode, ReferenceBlackWhiteAndWhitePoint) {
    const auto with = [&](std::array<float, 6> reference) {
        return written(folder_ / "r.tif", {16, 125, 235}, 3, [&](TIFF* tiff) {
            TIFFSetField(tiff, TIFFTAG_REFERENCEBLACKWHITE, reference.data());
        });
    };
    const Picture narrow = read_picture(with({16, 235, 16, 235, 16, 235}));
    EXPECT_NEAR(narrow.image.at(0, 0, 0), 0.0F, 1e-6);
    EXPECT_NEAR(narrow.image.at(1, 0, 0), 109.0F / 219.0F, 1e-6);
    EXPECT_NEAR(narrow.image.at(2, 0, 0), 1.0F, 1e-6);
    ASSERT_EQ(narrow.remarks.size(), 1U);
    EXPECT_NE(narrow.remarks[0].find("ReferenceBlackWhite"), std::string::npos);
    EXPECT_TRUE(read_picture(with({0, 255, 0, 255, 0, 255})).remarks.empty());
    const auto white = [&](std::array<float, 2> point) {
        return read_picture(
                   written(folder_ / "w.tif", {1, 2, 3}, 3,
                           [&](TIFF* tiff) { TIFFSetField(tiff, TIFFTAG_WHITEPOINT, point.data()); }))
            .remarks;
    };
    EXPECT_TRUE(white({0.3127F, 0.3290F}).empty());
    ASSERT_EQ(white({0.3457F, 0.3585F}).size(), 1U);
    EXPECT_NE(white({0.3457F, 0.3585F})[0].find("WhitePoint"), std::string::npos);
}

TEST_F(TiffDecode, PixelsWithoutDataAreTold) {
    const auto with = [&](const std::string& value) {
        const std::string bytes = value + std::string(1, '\0');
        put_bytes(
            folder_ / "n.tif",
            tiff_bytes({1, 2}, {{bits_tag, {8}}, {photometric, {black_is_zero}}, {42113, {0}}}, "\x07\x09"));
        std::string file = test::bytes_of(folder_ / "n.tif");
        // The tag as text of up to four bytes, in place.
        const std::size_t at = file.find(little_endian(42113, 2) + little_endian(3, 2));
        file.replace(at + 2, 2, little_endian(2, 2));
        file.replace(at + 4, 4, little_endian(static_cast<std::uint32_t>(bytes.size())));
        file.replace(at + 8, bytes.size(), bytes);
        put_bytes(folder_ / "n.tif", file);
        return read_picture(folder_ / "n.tif");
    };
    ASSERT_EQ(with("9").remarks.size(), 1U);
    EXPECT_NE(with("9").remarks[0].find("GDAL_NODATA 9"), std::string::npos);
    EXPECT_TRUE(with("8").remarks.empty());
    EXPECT_EQ(with("8").image.at(0, 0, 1), 9.0F / 255.0F);
}

TEST_F(TiffDecode, ColoursThatWereMultipliedByAlphaAreTold) {
    const auto with = [&](std::uint16_t kind, const std::string& pixels) {
        return read({1, 1},
                    {{bits_tag, {8, 8, 8, 8}}, {photometric, {rgb}}, {samples_tag, {4}}, {extra, {kind}}},
                    pixels)
            .remarks;
    };
    ASSERT_EQ(with(1, "\x10\x10\x10\x80").size(), 1U);
    EXPECT_NE(with(1, "\x10\x10\x10\x80")[0].find("associated alpha"), std::string::npos);
    EXPECT_TRUE(with(1, "\x10\x10\x10\xff").empty());
    EXPECT_TRUE(with(2, "\x10\x10\x10\x80").empty());
}

TEST_F(TiffDecode, AlphaByItsKind) {
    const std::vector<TiffTag> tags{
        {bits_tag, {8, 8, 8, 8, 8}}, {photometric, {rgb}}, {samples_tag, {5}}, {extra, {0, 2}}};
    const Picture picture = read({1, 1}, tags, "\x0a\x14\x1e\x28\x32");
    EXPECT_EQ(picture.image.planes(), 4);  // the fourth is something else
    EXPECT_EQ(picture.image.at(3, 0, 0), 40.0F / 255.0F);
    ASSERT_EQ(picture.alpha.size(), 1U);
    EXPECT_EQ(picture.alpha[0], 50.0F / 255.0F);
    ReadOptions options;
    options.planes = {"A", "R"};
    EXPECT_EQ(values({1, 1}, tags, "\x0a\x14\x1e\x28\x32", options),
              (std::vector<float>{50.0F / 255.0F, 10.0F / 255.0F}));
}

TEST_F(TiffDecode, OrientationTurnsPictureAndCrop) {
    // Stored 2 x 3 as 1 2 3 / 4 5 6.
    const std::string pixels = "\1\2\3\4\5\6";
    const std::array<std::vector<int>, 8> upright{{{1, 2, 3, 4, 5, 6},
                                                   {3, 2, 1, 6, 5, 4},
                                                   {6, 5, 4, 3, 2, 1},
                                                   {4, 5, 6, 1, 2, 3},
                                                   {1, 4, 2, 5, 3, 6},
                                                   {4, 1, 5, 2, 6, 3},
                                                   {6, 3, 5, 2, 4, 1},
                                                   {3, 6, 2, 5, 1, 4}}};
    for (std::uint16_t k = 1; k <= 8; ++k) {
        const std::vector<TiffTag> tags{{bits_tag, {8}}, {photometric, {black_is_zero}}, {orientation, {k}}};
        const Picture picture = read({2, 3}, tags, pixels);
        EXPECT_EQ(picture.image.width(), k < 5 ? 3 : 2);
        for (std::size_t i = 0; i < 6; ++i)
            EXPECT_EQ(std::lround(255.0F * picture.image.values()[i]), upright.at(k - 1U)[i]) << k;
        ReadOptions options;
        options.crop = Crop{1, 1, 1, 1};
        const int width = picture.image.width();
        EXPECT_EQ(read({2, 3}, tags, pixels, options).image.at(0, 0, 0),
                  picture.image.values()[static_cast<std::size_t>(width) + 1])
            << k;
    }
}

TEST_F(TiffDecode, OfSeveralPicturesTheFullOne) {
    const auto two = [&](std::uint16_t first_kind, std::uint16_t second_kind) {
        const auto tags = [](std::uint16_t kind) {
            return std::vector<TiffTag>{{254, {kind}}, {bits_tag, {8}}, {photometric, {black_is_zero}}};
        };
        std::string bytes = tiff_bytes({1, 1}, tags(first_kind), "\x10");
        const std::size_t at = bytes.size(), first_list = 8 + 2;
        const std::string second = test::tiff_directory({1, 2}, tags(second_kind), "\x20\x21", at);
        bytes.replace(first_list + 2 + 12 * 8, 4, little_endian(static_cast<std::uint32_t>(at + 2)));
        put_bytes(folder_ / "two.tif", bytes + second);
        return folder_ / "two.tif";
    };
    EXPECT_EQ(read_picture(two(1, 0)).image.size(), (Size{1, 2}));
    EXPECT_EQ(read_picture(two(0, 1)).image.size(), (Size{1, 1}));
    EXPECT_EQ(read_picture(two(0, 4)).image.size(), (Size{1, 1}));  // a mask
    ReadOptions options;
    options.part = "1";
    EXPECT_EQ(read_picture(two(0, 0), options).image.size(), (Size{1, 2}));
    try {
        static_cast<void>(read_picture(two(0, 2)));
        FAIL();
    } catch (const InputError& error) {
        EXPECT_EQ(error.found(), "it holds several pictures: 0 (1x1, 1 sample), 1 (2x1, 1 sample)");
        EXPECT_NE(error.remedy().find("--part"), std::string::npos);
    }
    options.part = "2";
    EXPECT_THROW(static_cast<void>(read_picture(two(0, 0), options)), InputError);
}

TEST_F(TiffDecode, WhatIsNotSupportedIsNamed) {
    const auto says = [](const std::string& message, const std::string& part) {
        return message.find(part) != std::string::npos && message.find('\n') == std::string::npos &&
               message.find("undamaged") == std::string::npos;
    };
    EXPECT_TRUE(says(refusal({1, 1}, {{bits_tag, {8}}, {259, {9999}}, {photometric, {black_is_zero}}}, "x"),
                     "compression"));
    EXPECT_TRUE(says(refusal({1, 1}, {{bits_tag, {8}}, {photometric, {32803}}}, "x"), "raw data"));
    EXPECT_TRUE(says(refusal({1, 1}, {{bits_tag, {8, 8, 8}}, {photometric, {10}}, {samples_tag, {3}}}, "xyz"),
                     "ITU"));
    EXPECT_TRUE(says(
        refusal({1, 1},
                {{bits_tag, {8, 8, 8, 8}}, {photometric, {separated}}, {samples_tag, {4}}, {ink_set, {2}}},
                "wxyz"),
        "inks"));
    EXPECT_TRUE(
        says(refusal({1, 1}, {{bits_tag, {8}}, {photometric, {white_is_zero}}, {format_tag, {2}}}, "x"),
             "signed"));
    for (const std::uint16_t bits : {std::uint16_t{4}, std::uint16_t{8}})
        EXPECT_TRUE(says(refusal({1, 2}, {{bits_tag, {bits}}, {photometric, {palette}}}, "xy"), "palette"))
            << bits;
    EXPECT_TRUE(
        says(refusal({1, 2}, {{bits_tag, {4, 4, 4}}, {photometric, {cielab}}, {samples_tag, {3}}}, "xyz"),
             "L*a*b*"));
    EXPECT_TRUE(says(refusal({1, 1}, {{bits_tag, {5, 6, 5}}, {photometric, {rgb}}, {samples_tag, {3}}}, "xy"),
                     "not supported"));
    // Damage is another thing.
    EXPECT_NE(refusal({90, 90}, {{bits_tag, {8}}, {photometric, {black_is_zero}}}, "x").find("undamaged"),
              std::string::npos);
}

}  // namespace
}  // namespace btfield
