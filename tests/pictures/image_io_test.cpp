#include "btfield/image_io.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <ostream>
#include <string>

#include "btfield/error.hpp"
#include "tests/picture_files.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using test::bytes_of;
using test::put_bytes;
using test::sample;
using test::sampled;
using test::TemporaryFolder;
using test::write_foreign;

const fs::path data{test::data_folder()};

void expect_equal(const Image& a, const Image& b) {
    ASSERT_EQ(a.size(), b.size());
    ASSERT_EQ(a.planes(), b.planes());
    const auto [at, other] = std::mismatch(a.values().begin(), a.values().end(), b.values().begin());
    if (at != a.values().end()) {
        ADD_FAILURE() << "value " << at - a.values().begin() << " is " << *other << ", not " << *at;
    }
}

// --- Round trips
// ---------------------------------------------------------------------------------------------------

struct Case {
    const char* extension;
    PixelType type;
    int planes;
    ColourSpace space;
    friend std::ostream& operator<<(std::ostream& out, const Case& c) {
        return out << c.extension << ' ' << name(c.type) << ' ' << c.planes << ' ' << name(c.space);
    }
};

class image_io_exact : public testing::TestWithParam<Case> {};

TEST_P(image_io_exact, round_trip) {
    const Case& c = GetParam();
    const TemporaryFolder folder;
    const fs::path path = folder / ("a" + std::string(c.extension));
    // Odd, not square, higher than one strip of the reader and the writer.
    const Image image = sampled({301, 17}, c.planes, c.space, c.type);
    testing::internal::CaptureStderr();
    const WriteReport report = write_picture(path, image, WriteOptions{c.type, c.type, true, {}});
    const Picture read = read_picture(path);
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_EQ(report.clamped_pixels, 0U);
    EXPECT_TRUE(report.remarks.empty());
    EXPECT_TRUE(read.remarks.empty());
    expect_equal(image, read.image);
    EXPECT_EQ(read.image.space(), c.space);
    EXPECT_EQ(read.type, c.type);
    EXPECT_TRUE(read.alpha.empty());
    EXPECT_EQ(read.file_bytes, fs::file_size(path));
    EXPECT_EQ(folder.names().size(), 1U);
}

std::vector<Case> exact_cases() {
    using enum ColourSpace;
    using enum PixelType;
    std::vector<Case> cases;
    for (const auto type : {uint8, uint16}) {
        for (const char* extension : {".png", ".pnm", ".pgm"})
            cases.push_back({extension, type, 1, unspecified});
        for (const char* extension : {".png", ".pnm", ".ppm", ".PNG"})
            cases.push_back({extension, type, 3, srgb});
        // PNG says so; PNM cannot.
        for (const auto space : {unspecified, linear, xyz}) cases.push_back({".png", type, 3, space});
    }
    for (const auto type : {uint8, uint16, half, float32}) {
        for (const int planes : {1, 2, 4, 5, 6, 31}) cases.push_back({".tif", type, planes, unspecified});
        for (const auto space : {unspecified, srgb, linear, xyz}) cases.push_back({".tiff", type, 3, space});
    }
    for (const auto type : {half, float32}) {
        for (const int planes : {1, 2, 4, 5, 6, 31, 101})
            cases.push_back({".exr", type, planes, unspecified});
        for (const auto space : {unspecified, srgb, linear, xyz}) cases.push_back({".exr", type, 3, space});
    }
    return cases;
}

INSTANTIATE_TEST_SUITE_P(all, image_io_exact, testing::ValuesIn(exact_cases()));

TEST(image_io, jpeg_is_close) {
    const TemporaryFolder folder;
    for (const int planes : {1, 3}) {
        Image image({45, 61}, planes, planes == 3 ? ColourSpace::srgb : ColourSpace::unspecified);
        for (int p = 0; p < planes; ++p) {
            for (int r = 0; r < 45; ++r) {
                for (int c = 0; c < 61; ++c) {
                    image.at(p, r, c) = 0.5F + 0.4F * std::sin(0.2F * static_cast<float>(r + p) +
                                                               0.1F * static_cast<float>(c));
                }
            }
        }
        write_picture(folder / "a.jpg", image);
        const Picture read = read_picture(folder / "a.jpg");
        ASSERT_EQ(read.image.size(), image.size());
        ASSERT_EQ(read.image.planes(), planes);
        EXPECT_EQ(read.image.space(), image.space());
        EXPECT_EQ(read.type, PixelType::uint8);
        double squares = 0.0;
        for (std::size_t i = 0; i < image.values().size(); ++i) {
            squares += std::pow(
                static_cast<double>(image.values()[i]) - static_cast<double>(read.image.values()[i]), 2.0);
        }
        // Quality 98 has quantiser steps of at most 5: an error of step/√12 in an orthonormal transform is
        // the same in the pixels; times the largest gain of YCbCr to RGB, and the rounding of both ends.
        const double bound = (5.0 / std::sqrt(12.0) * 1.772 + 1.0) / 255.0;
        EXPECT_LE(std::sqrt(squares / static_cast<double>(image.values().size())), bound);
    }
}

TEST(image_io, hdr_is_close) {
    const TemporaryFolder folder;
    Image image({33, 40}, 3, ColourSpace::linear);  // from 8 columns on the rows are run-length coded
    for (int p = 0; p < 3; ++p) {
        for (int r = 0; r < 33; ++r) {
            for (int c = 0; c < 40; ++c) {
                image.at(p, r, c) =
                    std::exp(0.3F * static_cast<float>(r - 16)) * static_cast<float>(1 + (p + c) % 3);
            }
        }
    }
    EXPECT_EQ(write_picture(folder / "a.hdr", image).clamped_pixels, 0U);
    const Picture read = read_picture(folder / "a.hdr");
    ASSERT_EQ(read.image.size(), image.size());
    ASSERT_EQ(read.image.planes(), 3);
    EXPECT_EQ(read.image.space(), ColourSpace::linear);
    EXPECT_EQ(read.type, PixelType::float32);
    for (int r = 0; r < 33; ++r) {
        for (int c = 0; c < 40; ++c) {
            // RGBE: mantissas of 8 bits on the exponent of the largest of the three, which is at least 128.
            const float bound = std::max({image.at(0, r, c), image.at(1, r, c), image.at(2, r, c)}) / 128.0F;
            for (int p = 0; p < 3; ++p) EXPECT_NEAR(read.image.at(p, r, c), image.at(p, r, c), bound);
        }
    }
}

// --- What files hold
// -----------------------------------------------------------------------------------------------

TEST(image_io, palette_png) {
    const Picture cork = read_picture(data / "cork.png");
    EXPECT_EQ(cork.image.size(), (Size{512, 512}));
    EXPECT_EQ(cork.image.planes(), 3);
    EXPECT_EQ(cork.image.space(), ColourSpace::srgb);
    EXPECT_EQ(cork.type, PixelType::uint8);
    EXPECT_TRUE(cork.alpha.empty());
    EXPECT_EQ(cork.file_bytes, 129528U);
    const auto red = cork.image.plane(0);
    EXPECT_EQ(*std::min_element(red.begin(), red.end()), 91.0F / 255.0F);
    EXPECT_EQ(*std::max_element(red.begin(), red.end()), 211.0F / 255.0F);
}

TEST(image_io, grey_stored_as_colour_keeps_its_planes) {
    const Picture rock = read_picture(data / "rock.png");
    EXPECT_EQ(rock.image.planes(), 3);
    EXPECT_TRUE(
        std::equal(rock.image.plane(0).begin(), rock.image.plane(0).end(), rock.image.plane(2).begin()));
}

TEST(image_io, grey) {
    const Picture grass = read_picture(data / "grass.png");
    EXPECT_EQ(grass.image.planes(), 1);
    EXPECT_EQ(grass.image.space(), ColourSpace::unspecified);
}

TEST(image_io, alpha_is_set_apart) {
    const Picture sand = read_picture(data / "sand.png");
    EXPECT_EQ(sand.image.planes(), 3);
    EXPECT_EQ(sand.image.space(), ColourSpace::srgb);
    ASSERT_EQ(sand.alpha.size(), area(sand.image.size()));
    EXPECT_TRUE(std::all_of(sand.alpha.begin(), sand.alpha.end(), [](float a) { return a == 1.0F; }));
}

TEST(image_io, six_bands) {
    const Picture landsat = read_picture(data / "landsat.tif");
    EXPECT_EQ(landsat.image.size(), (Size{192, 192}));
    EXPECT_EQ(landsat.image.planes(), 6);
    EXPECT_EQ(landsat.image.space(), ColourSpace::unspecified);
    EXPECT_TRUE(landsat.alpha.empty());
    const std::array<int, 6> least{52, 34, 21, 33, 30, 11};
    for (int p = 0; p < 6; ++p) {
        const auto band = landsat.image.plane(p);
        EXPECT_EQ(*std::min_element(band.begin(), band.end()),
                  static_cast<float>(least.at(static_cast<std::size_t>(p))) / 255.0F);
    }
}

TEST(image_io, xyz_by_chromaticities) {
    const Picture xyz = read_picture(data / "cork-xyz.exr");
    EXPECT_EQ(xyz.image.space(), ColourSpace::xyz);
    EXPECT_EQ(xyz.type, PixelType::half);
    // Y of the first pixel from the sRGB original: decoded, weighted with the Rec. 709 luminances.
    const Picture rgb = read_picture(data / "cork.png", Crop{0, 0, 1, 1});
    const auto decoded = [&](int p) {
        const double v = static_cast<double>(rgb.image.at(p, 0, 0));
        return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
    };
    const double luminance = 0.2126729 * decoded(0) + 0.7151522 * decoded(1) + 0.0721750 * decoded(2);
    // half keeps 11 bits: half a unit relative, and one more for the arithmetic of the tool that made the
    // file.
    EXPECT_NEAR(static_cast<double>(xyz.image.at(1, 0, 0)), luminance, luminance * 2.0 / 2048.0);

    const TemporaryFolder folder;
    write_picture(folder / "again.exr", xyz.image, xyz.type);
    const Picture again = read_picture(folder / "again.exr");
    EXPECT_EQ(again.image.space(), ColourSpace::xyz);
    expect_equal(xyz.image, again.image);
    // The attribute itself is there for other programs.
    const auto input = OIIO::ImageInput::open((folder / "again.exr").string());
    ASSERT_TRUE(input);
    const auto* attribute =
        input->spec().find_attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8));
    ASSERT_NE(attribute, nullptr);
    EXPECT_EQ(static_cast<const float*>(attribute->data())[0], 1.0F);
    EXPECT_EQ(static_cast<const float*>(attribute->data())[7], 1.0F / 3.0F);
}

TEST(image_io, exr_says_its_space) {
    const TemporaryFolder folder;
    const auto space = [&](const std::vector<std::string>& names, auto&& more) {
        OIIO::ImageSpec spec(4, 3, static_cast<int>(names.size()), OIIO::TypeDesc::HALF);
        spec.channelnames = names;
        spec.alpha_channel = -1;
        more(spec);
        write_foreign(folder / "a.exr", spec, std::vector<float>(12 * names.size(), 0.5F));
        return read_picture(folder / "a.exr").image.space();
    };
    const auto nothing = [](OIIO::ImageSpec&) {};
    EXPECT_EQ(space({"R", "G", "B"}, nothing), ColourSpace::linear);
    EXPECT_EQ(space({"diffuse.R", "diffuse.G", "diffuse.B"}, nothing), ColourSpace::linear);
    EXPECT_EQ(space({"X", "Y", "Z"}, nothing), ColourSpace::xyz);
    EXPECT_EQ(space({"400nm", "500nm", "600nm"}, nothing), ColourSpace::unspecified);
    EXPECT_EQ(space({"Y"}, nothing), ColourSpace::unspecified);
    // Rec. 709, said aloud.
    EXPECT_EQ(
        space({"R", "G", "B"},
              [](OIIO::ImageSpec& spec) {
                  const std::array<float, 8> rec709{0.64F, 0.33F, 0.3F, 0.6F, 0.15F, 0.06F, 0.3127F, 0.329F};
                  spec.attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8), rec709.data());
              }),
        ColourSpace::linear);
}

TEST(image_io, linear_png_is_told_by_its_gamma) {
    const TemporaryFolder folder;
    OIIO::ImageSpec spec(4, 3, 3, OIIO::TypeDesc::UINT16);
    spec.attribute("oiio:ColorSpace", "Linear");
    write_foreign(folder / "a.png", spec, std::vector<unsigned short>(36, 1000));
    EXPECT_EQ(read_picture(folder / "a.png").image.space(), ColourSpace::linear);
}

TEST(image_io, transparent_colours_come_as_stored) {
    const TemporaryFolder folder;
    for (const char* file : {"a.png", "a.tif"}) {
        OIIO::ImageSpec spec(2, 1, 4, OIIO::TypeDesc::UINT8);
        spec.attribute("oiio:UnassociatedAlpha", 1);
        write_foreign(folder / file, spec, std::vector<unsigned char>{200, 100, 50, 0, 20, 30, 40, 128});
        const Picture read = read_picture(folder / file);
        ASSERT_EQ(read.image.planes(), 3) << file;
        ASSERT_EQ(read.alpha.size(), 2U);
        EXPECT_EQ(read.alpha[0], 0.0F);
        EXPECT_EQ(read.alpha[1], 128.0F / 255.0F);
        EXPECT_EQ(read.image.at(0, 0, 0), 200.0F / 255.0F) << file;
        EXPECT_EQ(read.image.at(2, 0, 0), 50.0F / 255.0F);
        EXPECT_EQ(read.image.at(0, 0, 1), 20.0F / 255.0F);
        EXPECT_EQ(read.image.at(2, 0, 1), 40.0F / 255.0F);
    }
}

TEST(image_io, alpha_may_stand_anywhere) {
    const TemporaryFolder folder;
    // EXR sorts by name, and a spectral file has an alpha too.
    OIIO::ImageSpec spec(1, 1, 5, OIIO::TypeDesc::FLOAT);
    spec.channelnames = {"A", "band0", "band1", "band2", "band3"};
    spec.alpha_channel = 0;
    write_foreign(folder / "a.exr", spec, std::vector<float>{0.25F, 1, 2, 3, 4});
    const Picture read = read_picture(folder / "a.exr");
    ASSERT_EQ(read.image.planes(), 4);
    for (int p = 0; p < 4; ++p) EXPECT_EQ(read.image.at(p, 0, 0), static_cast<float>(p + 1));
    ASSERT_EQ(read.alpha.size(), 1U);
    EXPECT_EQ(read.alpha[0], 0.25F);

    OIIO::ImageSpec grey(1, 1, 2, OIIO::TypeDesc::UINT8);
    grey.channelnames = {"Y", "A"};
    grey.alpha_channel = 1;
    grey.attribute("oiio:UnassociatedAlpha", 1);
    write_foreign(folder / "a.png", grey, std::vector<unsigned char>{90, 60});
    const Picture with_alpha = read_picture(folder / "a.png");
    ASSERT_EQ(with_alpha.image.planes(), 1);
    EXPECT_EQ(with_alpha.image.at(0, 0, 0), 90.0F / 255.0F);
    EXPECT_EQ(with_alpha.alpha.at(0), 60.0F / 255.0F);
}

TEST(image_io, other_value_types) {
    const TemporaryFolder folder;
    const OIIO::ImageSpec wide(3, 1, 1, OIIO::TypeDesc::UINT32);
    write_foreign(folder / "a.tif", wide, std::vector<unsigned>{0, 0x80000000U, 0xffffffffU});
    Picture read = read_picture(folder / "a.tif");
    EXPECT_EQ(read.type, PixelType::float32);
    EXPECT_EQ(read.image.at(0, 0, 0), 0.0F);
    EXPECT_EQ(read.image.at(0, 0, 1), 2147483648.0F);
    EXPECT_EQ(read.image.at(0, 0, 2), 4294967295.0F);

    const OIIO::ImageSpec sign(3, 1, 1, OIIO::TypeDesc::INT16);
    write_foreign(folder / "b.tif", sign, std::vector<short>{-32767, 0, 32767});
    read = read_picture(folder / "b.tif");
    EXPECT_EQ(read.type, PixelType::float32);
    EXPECT_EQ(read.image.at(0, 0, 0), -32767.0F);
    EXPECT_EQ(read.image.at(0, 0, 2), 32767.0F);

    // half and float in one file: the wider of them.
    OIIO::ImageSpec mixed(1, 1, 2, OIIO::TypeDesc::FLOAT);
    mixed.channelnames = {"p", "q"};
    mixed.alpha_channel = -1;
    mixed.channelformats = {OIIO::TypeDesc::HALF, OIIO::TypeDesc::FLOAT};
    std::array<char, 6> packed{};
    const std::uint16_t low = 0x2e66;  // the half next to 0.1
    const float high = 0.1F;
    std::memcpy(packed.data(), &low, 2);
    std::memcpy(packed.data() + 2, &high, 4);
    const auto output = OIIO::ImageOutput::create((folder / "c.exr").string());
    ASSERT_TRUE(output && output->open((folder / "c.exr").string(), mixed));
    ASSERT_TRUE(output->write_image(OIIO::TypeDesc::UNKNOWN, packed.data()) && output->close());
    read = read_picture(folder / "c.exr");
    EXPECT_EQ(read.type, PixelType::float32);
    ASSERT_EQ(read.image.planes(), 2);
    EXPECT_EQ(read.image.at(0, 0, 0), 0.0999755859375F);
    EXPECT_EQ(read.image.at(1, 0, 0), 0.1F);
}

TEST(image_io, the_same_picture_makes_the_same_file) {
    const TemporaryFolder folder;
    const Image image = sampled({40, 30}, 3, ColourSpace::srgb, PixelType::uint8);
    std::array<char, 16> month{};
    const std::time_t now = std::time(nullptr);
    ASSERT_GT(std::strftime(month.data(), month.size(), "%Y:%m:", std::localtime(&now)), 0U);
    for (const std::string extension : {".png", ".jpg", ".tif", ".exr", ".hdr", ".ppm"}) {
        write_picture(folder / ("a" + extension), image);
        const std::string bytes = bytes_of(folder / ("a" + extension));
        EXPECT_EQ(bytes.find(month.data()), std::string::npos) << extension << " holds its date";
        write_picture(folder / ("b" + extension), image);
        EXPECT_EQ(bytes, bytes_of(folder / ("b" + extension))) << extension;
    }
}

TEST(image_io, pnm_of_all_kinds) {
    const TemporaryFolder folder;
    using namespace std::string_literals;
    const auto values = [&](const std::string& bytes) {
        put_bytes(folder / "a.pnm", bytes);
        const Picture read = read_picture(folder / "a.pnm");
        const auto all = read.image.values();
        return std::vector<float>(all.begin(), all.end());
    };
    EXPECT_EQ(values("P2\n# a comment\n2 1\n255\n51 255\n"), (std::vector<float>{51.0F / 255.0F, 1.0F}));
    EXPECT_EQ(values("P5\n2 1\n255\n\x33\xff"), (std::vector<float>{51.0F / 255.0F, 1.0F}));
    EXPECT_EQ(values("P3\n1 1\n255\n0 51 255\n"), (std::vector<float>{0.0F, 51.0F / 255.0F, 1.0F}));
    EXPECT_EQ(values("P6 1 1 255\n\0\x33\xff"s), (std::vector<float>{0.0F, 51.0F / 255.0F, 1.0F}));
    EXPECT_EQ(values("P5\n2 1\n65535\n\x33\x33\xff\xff"), (std::vector<float>{13107.0F / 65535.0F, 1.0F}));
    EXPECT_EQ(values("P4\n8 1\n\x81"), (std::vector<float>{0, 1, 1, 1, 1, 1, 1, 0}));
}

TEST(image_io, pnm_of_several_pictures) {
    const TemporaryFolder folder;
    put_bytes(folder / "a.pnm", "P5 1 1 255\n\x33P4\n# bits\n1 1\n\x80P6 1 1 255\nabc");
    EXPECT_THROW(static_cast<void>(read_picture(folder / "a.pnm")), InputError);
    ReadOptions options;
    options.part = "2";
    EXPECT_EQ(read_picture(folder / "a.pnm", options).image.at(2, 0, 0), static_cast<float>('c') / 255.0F);
    options.part = "3";
    EXPECT_THROW(static_cast<void>(read_picture(folder / "a.pnm", options)), InputError);
    // What follows is not always a picture.
    put_bytes(folder / "b.pnm", "P5 1 1 255\n\x33 and more");
    EXPECT_EQ(read_picture(folder / "b.pnm").image.at(0, 0, 0), 0.2F);
}

// --- Crops
// ---------------------------------------------------------------------------------------------------------

void expect_crops(const fs::path& path) {
    const Picture whole = read_picture(path);
    const int width = whole.image.width();
    const int height = whole.image.height();
    const std::array<Crop, 6> crops{{{0, 0, width, height},
                                     {0, 0, 1, 1},
                                     {width - 1, height - 1, 1, 1},
                                     {3, 5, width - 7, height - 9},
                                     {width / 2, 0, width - width / 2, height},
                                     {0, height / 2, width, height - height / 2}}};
    for (const Crop& c : crops) {
        const Picture part = read_picture(path, c);
        expect_equal(whole.image.crop(c.y, c.x, {c.height, c.width}), part.image);
        EXPECT_EQ(part.image.space(), whole.image.space());
        EXPECT_EQ(part.alpha.empty(), whole.alpha.empty());
        if (!part.alpha.empty()) {
            ASSERT_EQ(part.alpha.size(), area({c.height, c.width}));
            EXPECT_EQ(part.alpha.front(),
                      whole.alpha[static_cast<std::size_t>(c.y) * static_cast<std::size_t>(width) +
                                  static_cast<std::size_t>(c.x)]);
        }
    }
}

TEST(image_io, crop_equals_the_whole_cropped) {
    const TemporaryFolder folder;
    for (const char* file : {"cork.png", "sand.png", "landsat.tif", "cork-xyz.exr"})
        expect_crops(data / file);
    const Image tall = sampled({600, 20}, 3, ColourSpace::srgb, PixelType::uint8);  // several strips
    for (const char* file : {"a.png", "a.tif", "a.exr", "a.jpg", "a.ppm", "a.hdr"}) {
        write_picture(folder / file, tall);
        expect_crops(folder / file);
    }
}

TEST(image_io, crop_of_tiled_files) {
    const TemporaryFolder folder;
    for (const char* file : {"a.tif", "a.exr"}) {
        OIIO::ImageSpec spec(75, 53, 3, OIIO::TypeDesc::HALF);
        if (std::string_view(file) == "a.tif") spec.format = OIIO::TypeDesc::UINT8;
        spec.tile_width = 32;
        spec.tile_height = 16;
        std::vector<float> values;
        for (int i = 0; i < 75 * 53 * 3; ++i) values.push_back(static_cast<float>(i % 251) / 255.0F);
        const auto output = OIIO::ImageOutput::create((folder / file).string());
        ASSERT_TRUE(output && output->open((folder / file).string(), spec));
        ASSERT_TRUE(output->write_image(OIIO::TypeDesc::FLOAT, values.data()) && output->close());
        const Picture whole = read_picture(folder / file);
        ASSERT_EQ(whole.image.size(), (Size{53, 75}));
        const float expected = values[(52 * 75 + 74) * 3 + 1];
        EXPECT_NEAR(whole.image.at(1, 52, 74), expected, 1.0F / 2048.0F);  // half: 11 bits
        expect_crops(folder / file);
    }
}

TEST(image_io, crop_counts_from_the_first_stored_pixel) {
    const TemporaryFolder folder;
    OIIO::ImageSpec spec(4, 3, 1, OIIO::TypeDesc::FLOAT);
    spec.x = 10;
    spec.y = -5;
    spec.full_width = 100;
    spec.full_height = 100;
    std::vector<float> values;
    for (int i = 0; i < 12; ++i) values.push_back(static_cast<float>(i));
    write_foreign(folder / "a.exr", spec, values);
    const Picture read = read_picture(folder / "a.exr", Crop{1, 2, 2, 1});
    EXPECT_EQ(read.image.size(), (Size{1, 2}));
    EXPECT_EQ(read.image.at(0, 0, 0), 9.0F);
    EXPECT_EQ(read.image.at(0, 0, 1), 10.0F);
}

}  // namespace
}  // namespace btfield
