// Colours beside data and planes of grey: what is known of them, and what files get.

#include "host/pictures/colour.hpp"

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>
#include <tiffio.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "tests/picture_bytes.hpp"
#include "tests/picture_files.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using detail::srgb_decoded;
using detail::srgb_encoded;
using test::little_endian;
using test::TiffTag;
constexpr ColourSpace unspecified = ColourSpace::unspecified, srgb = ColourSpace::srgb,
                      linear = ColourSpace::linear;

using Spaces = std::vector<ColourSpace>;

class Colour : public testing::Test {
  protected:
    Picture read_tiff(const std::vector<TiffTag>& tags, const std::string& pixels,
                      const ReadOptions& options = {}) {
        test::put_bytes(folder_ / "in.tif", test::tiff_bytes({1, 1}, tags, pixels));
        return read_picture(folder_ / "in.tif", options);
    }
    Picture read_exr(const std::vector<std::string>& names, const std::vector<float>& values) {
        OIIO::ImageSpec spec(1, 1, static_cast<int>(names.size()), OIIO::TypeDesc::FLOAT);
        spec.channelnames = names;
        spec.alpha_channel = spec.z_channel = -1;
        test::write_foreign(folder_ / "in.exr", spec, values);
        return read_picture(folder_ / "in.exr");
    }
    Picture written(const std::string& name, const Image& image, PixelType source, bool keep_values = false) {
        const WriteReport report =
            write_picture(folder_ / name, image, WriteOptions{source, {}, keep_values, {}, {}});
        remarks_ = report.remarks;
        return read_picture(folder_ / name);
    }
    test::TemporaryFolder folder_;
    std::vector<std::string> remarks_;
};

/// 16 bits, RGB and one sample of which the file says that it is no alpha.
const std::vector<TiffTag> colours_and_data{{258, {16, 16, 16, 16}}, {262, {2}}, {277, {4}}, {338, {0}}};
std::string samples(std::initializer_list<std::uint32_t> values) {
    std::string bytes;
    for (const std::uint32_t value : values) bytes += little_endian(value, 2);
    return bytes;
}

/// RGB and a sample that is no alpha, one pixel of 16 bits.
void put_tiff(const std::filesystem::path& path, std::array<std::uint16_t, 4> pixel,
              const std::function<void(TIFF*)>& tags) {
    TIFF* const file = TIFFOpen(path.c_str(), "w");
    ASSERT_NE(file, nullptr);
    TIFFSetField(file, TIFFTAG_IMAGEWIDTH, 1);
    TIFFSetField(file, TIFFTAG_IMAGELENGTH, 1);
    TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, 4);
    TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, 16);
    TIFFSetField(file, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB);
    const std::uint16_t kind = EXTRASAMPLE_UNSPECIFIED;
    TIFFSetField(file, TIFFTAG_EXTRASAMPLES, 1, &kind);
    TIFFSetField(file, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    tags(file);
    TIFFWriteEncodedStrip(file, 0, pixel.data(), 8);
    TIFFClose(file);
}

TEST_F(Colour, OfTiffBesideDataBecomesLinearInExrAndComesBack) {
    const Picture picture = read_tiff(colours_and_data, samples({10000, 30000, 60000, 20000}));
    ASSERT_EQ(picture.image.planes(), 4);
    EXPECT_EQ(picture.image.space(), unspecified);
    EXPECT_EQ(picture.image.plane_spaces(), (Spaces{srgb, srgb, srgb, unspecified}));
    const Picture light = written("a.exr", picture.image, picture.type);
    EXPECT_EQ(light.image.names(), (std::vector<std::string>{"R", "G", "B", "plane3"}));
    EXPECT_EQ(light.image.plane_spaces(), (Spaces{linear, linear, linear, unspecified}));
    for (int p = 0; p < 3; ++p)
        EXPECT_NEAR(light.image.at(p, 0, 0), srgb_decoded(picture.image.at(p, 0, 0)), 1e-6) << p;
    EXPECT_EQ(light.image.at(3, 0, 0), picture.image.at(3, 0, 0));
    ASSERT_EQ(remarks_.size(), 1U);
    EXPECT_NE(remarks_[0].find("planes 0, 1 and 2"), std::string::npos) << remarks_[0];
    const Picture back = written("b.tif", light.image, PixelType::uint16);
    EXPECT_EQ(back.image.plane_spaces(), (Spaces{srgb, srgb, srgb, unspecified}));
    for (int p = 0; p < 4; ++p)
        EXPECT_NEAR(back.image.at(p, 0, 0), picture.image.at(p, 0, 0), 1.0 / 65535) << p;
    // Numbers as they are, and the file says what they are.
    const Picture kept = written("c.exr", picture.image, picture.type, true);
    EXPECT_EQ(kept.image.plane_spaces(), (Spaces{srgb, srgb, srgb, unspecified}));
    EXPECT_EQ(kept.image.at(0, 0, 0), picture.image.at(0, 0, 0));
    EXPECT_TRUE(remarks_.empty());
    // What is no colour stays none.
    Image data = picture.image;
    data.set_space(unspecified);
    EXPECT_TRUE(written("d.tif", data, picture.type).image.plane_spaces().empty());
    EXPECT_EQ(written("d.exr", data, picture.type).image.at(0, 0, 0), data.at(0, 0, 0));
}

TEST_F(Colour, OfTiffBesideDataIsConvertedByItsPrimaries) {
    const Chromaticities p3{0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290};
    put_tiff(folder_ / "p3.tif", {50000, 20000, 10000, 7000}, [](TIFF* file) {
        const std::array<float, 2> white{0.3127F, 0.3290F};
        const std::array<float, 6> primaries{0.680F, 0.320F, 0.265F, 0.690F, 0.150F, 0.060F};
        TIFFSetField(file, TIFFTAG_WHITEPOINT, white.data());
        TIFFSetField(file, TIFFTAG_PRIMARYCHROMATICITIES, primaries.data());
    });
    const Picture picture = read_picture(folder_ / "p3.tif");
    const detail::Matrix3 m = detail::rec709_from(p3).value();
    const std::array<double, 3> v{srgb_decoded(50000 / 65535.0), srgb_decoded(20000 / 65535.0),
                                  srgb_decoded(10000 / 65535.0)};
    for (std::size_t i = 0; i < 3; ++i)
        EXPECT_NEAR(picture.image.at(static_cast<int>(i), 0, 0),
                    srgb_encoded(m[3 * i] * v[0] + m[3 * i + 1] * v[1] + m[3 * i + 2] * v[2]), 1e-5);
    EXPECT_NEAR(picture.image.at(3, 0, 0), 7000 / 65535.0, 1e-7);
    ASSERT_EQ(picture.remarks.size(), 1U);
    // One colour alone is converted with the others.
    const Picture red = read_picture(folder_ / "p3.tif", ReadOptions{{}, {}, {"R"}, false});
    EXPECT_EQ(red.image.at(0, 0, 0), picture.image.at(0, 0, 0));
    EXPECT_EQ(red.image.plane_spaces(), Spaces{srgb});
}

TEST_F(Colour, SamplesThatMayBeLightAreTakenForDataWithAWord) {
    // Grey beside data; and RGB in front of so many samples that it may be bands.
    const std::vector<TiffTag> two{{258, {8, 8}}, {262, {1}}, {277, {2}}, {338, {0}}};
    const std::vector<TiffTag> bands{{258, {8, 8, 8, 8, 8, 8}}, {262, {2}}, {277, {6}}, {338, {0, 0, 0}}};
    for (const auto& [tags, count] : {std::pair(two, 2), std::pair(bands, 6)}) {
        const std::string pixel = std::string("abcdef").substr(0, static_cast<std::size_t>(count));
        const Picture picture = read_tiff(tags, pixel);
        EXPECT_EQ(picture.image.planes(), count);
        EXPECT_TRUE(picture.image.plane_spaces().empty());
        ASSERT_EQ(picture.remarks.size(), 1U);
        EXPECT_EQ(picture.remarks[0],
                  "its " + std::to_string(count) +
                      " planes are taken for data: the file does not say which are light");
        // Whoever chooses knows.
        ReadOptions kept;
        kept.keep_values = true;
        EXPECT_TRUE(read_tiff(tags, pixel, kept).remarks.empty());
        EXPECT_TRUE(read_tiff(tags, pixel, ReadOptions{{}, {}, {"1", "0"}, false}).remarks.empty());
        // Data stay, and names say what they are.
        Image image = picture.image;
        std::vector<std::string> names;
        for (int p = 0; p < count; ++p) names.push_back("band " + std::to_string(p));
        image.set_names(names);
        const Picture back = written("b.tif", image, PixelType::uint8);
        EXPECT_TRUE(back.remarks.empty());
        EXPECT_EQ(back.image.names(), names);
        EXPECT_NEAR(written("b.exr", image, PixelType::uint8).image.at(0, 0, 0), image.at(0, 0, 0), 1e-3);
    }
    // Maps of the earth are data, as everybody knows.
    std::vector<TiffTag> map = two;
    map.push_back({33550, {1, 1, 1}});
    EXPECT_TRUE(read_tiff(map, "ab").remarks.empty());
}

TEST_F(Colour, OfExrBesideDepthIsEncodedInWholeNumbers) {
    const Picture picture = read_exr({"R", "G", "B", "Z"}, {0.1F, 0.2F, 0.4F, 0.5F});
    EXPECT_EQ(picture.image.plane_spaces(), (Spaces{linear, linear, linear, unspecified}));
    WriteOptions options;
    options.source = options.type.emplace(PixelType::uint16);
    remarks_ = write_picture(folder_ / "a.tif", picture.image, options).remarks;
    const Picture back = read_picture(folder_ / "a.tif");
    EXPECT_NEAR(back.image.at(0, 0, 0), srgb_encoded(picture.image.at(0, 0, 0)), 1e-5);
    EXPECT_NEAR(back.image.at(3, 0, 0), 0.5, 1e-5);
    EXPECT_EQ(back.image.plane_spaces(), (Spaces{srgb, srgb, srgb, unspecified}));
    EXPECT_EQ(remarks_.size(), 1U);
    // Normals are none; X, Y and Z beside a depth are.
    EXPECT_TRUE(
        read_exr({"normal.R", "normal.G", "normal.B", "depth"}, {0, 0, 1, 2}).image.plane_spaces().empty());
    const Picture xyz = read_exr({"X", "Y", "Z", "depth"}, {0.2F, 0.3F, 0.4F, 2.0F});
    EXPECT_EQ(xyz.image.plane_spaces(),
              (Spaces{ColourSpace::xyz, ColourSpace::xyz, ColourSpace::xyz, unspecified}));
    EXPECT_EQ(written("xyz.exr", xyz.image, PixelType::float32).image.at(0, 0, 0), 0.2F);
    Image rgb({1, 1}, 3, ColourSpace::xyz);
    for (int p = 0; p < 3; ++p) rgb.at(p, 0, 0) = xyz.image.at(p, 0, 0);
    detail::convert(rgb, linear);
    EXPECT_NEAR(written("xyz.tif", xyz.image, PixelType::float32).image.at(0, 0, 0), rgb.at(0, 0, 0), 1e-6);
}

TEST_F(Colour, GreyOfScreensBecomesLightAndBack) {
    test::put_bytes(folder_ / "in.png", test::png_bytes({1, 1}, 0, "\x64"));
    const Picture picture = read_picture(folder_ / "in.png");
    EXPECT_EQ(picture.image.plane_spaces(), Spaces{srgb});
    const Picture light = written("a.exr", picture.image, picture.type);
    EXPECT_NEAR(light.image.at(0, 0, 0), srgb_decoded(100 / 255.0), 1e-4);
    EXPECT_EQ(light.image.plane_spaces(), Spaces{linear});
    ASSERT_EQ(remarks_.size(), 1U);
    EXPECT_NE(remarks_[0].find("linear"), std::string::npos) << remarks_[0];
    EXPECT_NEAR(written("b.png", light.image, PixelType::uint8).image.at(0, 0, 0), 100 / 255.0, 1e-6);
    EXPECT_EQ(remarks_.size(), 1U);
    EXPECT_EQ(written("c.exr", picture.image, picture.type, true).image.plane_spaces(), Spaces{srgb});
    // A height stays one on all ways.
    Image height = picture.image;
    height.set_plane_spaces({});
    for (const char* name : {"h.exr", "h.png", "h.tif"}) {
        const Picture read = written(name, height, PixelType::uint16);
        EXPECT_NEAR(read.image.at(0, 0, 0), height.at(0, 0, 0), 1e-5) << name;
        EXPECT_TRUE(read.image.plane_spaces().empty()) << name;
        EXPECT_TRUE(remarks_.empty()) << name;
    }
    // Numbers with a unit are no light.
    EXPECT_TRUE(
        read_tiff({{258, {16}}, {262, {1}}, {339, {2}}}, little_endian(300, 2)).image.plane_spaces().empty());
    EXPECT_TRUE(read_exr({"height"}, {0.5F}).image.plane_spaces().empty());
}

TEST_F(Colour, SpacesOfPlanesStayWithTheImage) {
    Image image({2, 2}, 4);
    image.set_plane_spaces({ColourSpace::xyz, ColourSpace::xyz, ColourSpace::xyz, unspecified});
    EXPECT_EQ(image.crop(0, 0, {1, 1}).plane_spaces().size(), 4U);
    EXPECT_EQ(image.window(0, 0, {1, 1}).plane_spaces().size(), 4U);
    EXPECT_EQ(image.plane_space(3), unspecified);
    EXPECT_THROW(image.set_plane_spaces({srgb}), InputError);
    EXPECT_THROW(image.set_plane_spaces({ColourSpace::xyz, ColourSpace::xyz, srgb, srgb}), InputError);
    image.set_space(linear);
    EXPECT_TRUE(image.plane_spaces().empty());
    EXPECT_EQ(image.plane_space(3), linear);
}

}  // namespace
}  // namespace btfield
