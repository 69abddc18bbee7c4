// What files say of their colours: PNG chunks, ICC profiles, EXIF, EXR and Radiance primaries.

#include "host/pictures/colour_profile.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/pictures/colour.hpp"
#include "tests/foreign_bytes.hpp"
#include "tests/picture_bytes.hpp"
#include "tests/picture_files.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using detail::srgb_decoded;
using detail::srgb_encoded;
using test::big_endian;
using test::png_bytes;
using test::png_chunk;
using test::profile_bytes;
using test::put_bytes;
using test::TemporaryFolder;

constexpr Chromaticities display_p3{0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290};

std::string hundred_thousandth(double value) {
    return big_endian(static_cast<std::uint32_t>(std::lround(value * 1e5)));
}

std::string gamma_chunk(double gamma) {
    return png_chunk("gAMA", hundred_thousandth(gamma));
}

std::string primaries_chunk(const Chromaticities& c) {
    std::string content;
    for (const std::size_t i : {6U, 7U, 0U, 1U, 2U, 3U, 4U, 5U}) content += hundred_thousandth(c.at(i));
    return png_chunk("cHRM", content);
}

std::string profile_chunk(const std::string& profile) {
    return png_chunk("iCCP", std::string("name\0\0", 6) + test::deflated(profile));
}

class ColourProfile : public testing::Test {
  protected:
    /// One pixel of 200, 100, 50, or grey 100, with these chunks.
    Picture png(const std::string& chunks, int colour = 2, bool keep_values = false) {
        put_bytes(folder_ / "a.png",
                  png_bytes({1, 1}, colour, colour == 2 ? "\xc8\x64\x32" : "\x64", chunks));
        return read_picture(folder_ / "a.png", {{}, {}, {}, keep_values});
    }
    /// The pixel as sRGB, when it is light of these primaries by the curve.
    static std::array<double, 3> converted(const Chromaticities& c, auto&& light) {
        const detail::Matrix3 m = detail::rec709_from(c).value();
        const std::array<double, 3> v{light(200 / 255.0), light(100 / 255.0), light(50 / 255.0)};
        std::array<double, 3> result{};
        for (std::size_t i = 0; i < 3; ++i)
            result[i] = srgb_encoded(m[3 * i] * v[0] + m[3 * i + 1] * v[1] + m[3 * i + 2] * v[2]);
        return result;
    }
    static void expect_pixel(const Picture& picture, const std::array<double, 3>& expected,
                             double tolerance) {
        for (int p = 0; p < 3; ++p)
            EXPECT_NEAR(picture.image.at(p, 0, 0), expected[static_cast<std::size_t>(p)], tolerance) << p;
    }
    static void expect_untouched(const Picture& picture, ColourSpace space) {
        EXPECT_EQ(picture.image.at(0, 0, 0), 200.0F / 255.0F);
        EXPECT_EQ(picture.image.at(2, 0, 0), 50.0F / 255.0F);
        EXPECT_EQ(picture.image.space(), space);
        EXPECT_TRUE(picture.remarks.empty());
    }
    TemporaryFolder folder_;
};

TEST_F(ColourProfile, PngGamma) {
    expect_untouched(png({}), ColourSpace::srgb);
    expect_untouched(png(gamma_chunk(0.45455)), ColourSpace::srgb);
    expect_untouched(png(gamma_chunk(1.0)), ColourSpace::linear);
    expect_untouched(png(gamma_chunk(0.5) + png_chunk("sRGB", std::string(1, '\0'))), ColourSpace::srgb);
    const Picture squared = png(gamma_chunk(0.5));
    EXPECT_EQ(squared.image.space(), ColourSpace::srgb);
    ASSERT_EQ(squared.remarks.size(), 1U);
    EXPECT_NE(squared.remarks[0].find("gAMA"), std::string::npos);
    expect_pixel(squared, converted(detail::rec709, [](double v) { return v * v; }), 1e-6);
    expect_untouched(png(gamma_chunk(0.5), 2, true), ColourSpace::unspecified);
    // Grey as well; linear light is said of one plane too.
    EXPECT_NEAR(png(gamma_chunk(0.5), 0).image.at(0, 0, 0), srgb_encoded(std::pow(100 / 255.0, 2.0)), 1e-6);
    EXPECT_EQ(png(gamma_chunk(1.0), 0).image.space(), ColourSpace::linear);
    EXPECT_EQ(png({}, 0).image.space(), ColourSpace::unspecified);
}

TEST_F(ColourProfile, PngOfNarrowRangeBecomesFull) {
    const auto codes = [](char matrix, char full) {
        return png_chunk("cICP", std::string{'\1', '\15', matrix, full});
    };
    const Picture narrow = png(codes('\0', '\0'));
    EXPECT_EQ(narrow.image.space(), ColourSpace::srgb);
    EXPECT_NEAR(narrow.image.at(0, 0, 0), (200 - 16) / 219.0, 1e-6);
    EXPECT_NEAR(narrow.image.at(2, 0, 0), (50 - 16) / 219.0, 1e-6);
    ASSERT_EQ(narrow.remarks.size(), 1U);
    EXPECT_NE(narrow.remarks[0].find("narrow"), std::string::npos);
    expect_untouched(png(codes('\0', '\0'), 2, true), ColourSpace::unspecified);
    EXPECT_EQ(png(codes('\1', '\1')).remarks.size(), 1U);  // YCbCr, which no PNG is
}

TEST_F(ColourProfile, PngPrimariesAndCodePoints) {
    expect_untouched(png(primaries_chunk(detail::rec709)), ColourSpace::srgb);
    const auto expected = converted(display_p3, [](double v) { return srgb_decoded(v); });
    expect_pixel(png(primaries_chunk(display_p3)), expected, 1e-6);
    expect_pixel(png(png_chunk("cICP", std::string("\14\15\0\1", 4))), expected, 1e-6);
    expect_untouched(png(png_chunk("cICP", std::string("\1\15\0\1", 4)) + gamma_chunk(0.5)),
                     ColourSpace::srgb);
    expect_untouched(png(png_chunk("cICP", std::string("\1\10\0\1", 4))), ColourSpace::linear);
    for (const char transfer : {'\20', '\22'})
        EXPECT_THROW(static_cast<void>(png(png_chunk("cICP", {'\1', transfer, '\0', '\1'}))), InputError);
}

TEST_F(ColourProfile, IccOfColoursAndGrey) {
    const Picture picture = png(profile_chunk(profile_bytes(display_p3, 2.2)));
    EXPECT_EQ(picture.image.space(), ColourSpace::srgb);
    // Numbers of profiles have 16 bits.
    expect_pixel(picture, converted(display_p3, [](double v) { return std::pow(v, 2.2); }), 3e-4);
    ASSERT_EQ(picture.remarks.size(), 1U);
    EXPECT_NE(picture.remarks[0].find("colour profile"), std::string::npos);
    expect_untouched(png(profile_chunk(profile_bytes(display_p3, 2.2)), 2, true), ColourSpace::unspecified);
    // Pure green of wide primaries leaves sRGB, and is not cut.
    put_bytes(folder_ / "green.png", png_bytes({1, 1}, 2, std::string("\0\xff\0", 3),
                                               profile_chunk(profile_bytes(display_p3, 2.2))));
    EXPECT_LT(read_picture(folder_ / "green.png").image.at(0, 0, 0), -0.1F);
    EXPECT_EQ(png(profile_chunk(profile_bytes(display_p3, 1.0))).image.space(), ColourSpace::linear);
    EXPECT_NEAR(png(profile_chunk(profile_bytes({}, 1.8)), 0).image.at(0, 0, 0),
                srgb_encoded(std::pow(100 / 255.0, 1.8)), 3e-4);
    // One of another kind, and one that is none.
    const Picture grey_profile = png(profile_chunk(profile_bytes({}, 1.8)));
    EXPECT_EQ(grey_profile.image.at(0, 0, 0), 200.0F / 255.0F);
    EXPECT_EQ(grey_profile.remarks.size(), 1U);
    EXPECT_EQ(png(profile_chunk("no profile")).remarks.size(), 1U);
    EXPECT_EQ(png(png_chunk("iCCP", "x")).remarks.size(), 1U);
}

TEST_F(ColourProfile, SrgbProfileLeavesNumbersAlone) {
    expect_untouched(png(profile_chunk(test::srgb_profile_bytes())), ColourSpace::srgb);
}

TEST_F(ColourProfile, PngIsTurnedAndPalettesAreColours) {
    put_bytes(folder_ / "o.png", png_bytes({1, 2}, 0, "\x0a\x14", png_chunk("eXIf", test::exif_bytes(6))));
    const Picture turned = read_picture(folder_ / "o.png");
    EXPECT_EQ(turned.image.size(), (Size{2, 1}));
    EXPECT_EQ(turned.image.at(0, 1, 0), 20.0F / 255.0F);
    std::string chunks = png_chunk("PLTE", std::string("\0\0\0\xc8\x64\x32", 6)) + gamma_chunk(0.5);
    put_bytes(folder_ / "p.png", png_bytes({1, 1}, 3, "\1", chunks));
    expect_pixel(read_picture(folder_ / "p.png"), converted(detail::rec709, [](double v) { return v * v; }),
                 1e-6);
}

TEST_F(ColourProfile, JpegProfileInPiecesAndOrientation) {
    Image image({8, 16}, 3, ColourSpace::srgb);
    for (int p = 0; p < 3; ++p)
        for (float& v : image.plane(p))
            v = std::array{200.0F, 100.0F, 50.0F}[static_cast<std::size_t>(p)] / 255.0F;
    write_picture(folder_ / "plain.jpg", image);
    const Picture plain = read_picture(folder_ / "plain.jpg");
    const std::string profile = profile_bytes(display_p3, 2.2), head = std::string("ICC_PROFILE\0", 12);
    const std::size_t half = profile.size() / 2;
    put_bytes(folder_ / "a.jpg",
              test::with_segments(test::bytes_of(folder_ / "plain.jpg"),
                                  {{0xE1, std::string("Exif\0\0", 6) + test::exif_bytes(8)},
                                   {0xE2, head + "\2\2" + profile.substr(half)},
                                   {0xE2, head + "\1\2" + profile.substr(0, half)}}));
    const Picture picture = read_picture(folder_ / "a.jpg");
    EXPECT_EQ(picture.image.size(), (Size{16, 8}));
    const detail::Matrix3 m = detail::rec709_from(display_p3).value();
    for (std::size_t i = 0; i < 3; ++i) {
        double light = 0.0;
        for (std::size_t k = 0; k < 3; ++k)
            light +=
                m[3 * i + k] * std::pow(static_cast<double>(plain.image.plane(static_cast<int>(k))[0]), 2.2);
        EXPECT_NEAR(picture.image.plane(static_cast<int>(i))[0], srgb_encoded(light), 3e-4) << i;
    }
}

TEST_F(ColourProfile, JpegProfileThatLacksAPieceIsTold) {
    write_picture(folder_ / "plain.jpg", Image({8, 16}, 3, ColourSpace::srgb));
    const std::string head = std::string("ICC_PROFILE\0", 12), piece(100, 'x');
    using Segments = std::vector<std::pair<int, std::string>>;
    for (const Segments& segments : {Segments{{0xE2, head + "\1\3" + piece}, {0xE2, head + "\3\3" + piece}},
                                     Segments{{0xE2, head + "\1\2" + piece}, {0xE2, head + "\1\2" + piece}},
                                     Segments{{0xE2, head + "\5\2" + piece}}, Segments{{0xE2, head}}}) {
        put_bytes(folder_ / "a.jpg", test::with_segments(test::bytes_of(folder_ / "plain.jpg"), segments));
        EXPECT_EQ(read_picture(folder_ / "a.jpg").remarks,
                  std::vector<std::string>{"its colour profile is damaged and was ignored"});
    }
}

TEST_F(ColourProfile, JpegIsTurnedByXmpWhereExifIsSilent) {
    write_picture(folder_ / "plain.jpg", Image({8, 16}, 3, ColourSpace::srgb));
    const std::string xmp = std::string("http://ns.adobe.com/xap/1.0/\0", 29) + "<r tiff:Orientation='8'/>";
    const auto with = [&](const std::string& exif) {
        put_bytes(folder_ / "a.jpg",
                  test::with_segments(test::bytes_of(folder_ / "plain.jpg"), {{0xE1, exif}, {0xE1, xmp}}));
        return read_picture(folder_ / "a.jpg");
    };
    const Picture turned = with("Exif of another kind");
    EXPECT_EQ(turned.image.size(), (Size{16, 8}));
    ASSERT_EQ(turned.remarks.size(), 1U);
    EXPECT_NE(turned.remarks[0].find("XMP"), std::string::npos);
    EXPECT_EQ(with(std::string("Exif\0\0", 6) + test::exif_bytes(1)).image.size(), (Size{8, 16}));
}

TEST_F(ColourProfile, JpegOfInksEitherWayRound) {
    // Adobe stores 255 - ink.
    for (const bool adobe : {true, false}) {
        const std::array<unsigned char, 4> inks = adobe ? std::array<unsigned char, 4>{204, 255, 0, 127}
                                                        : std::array<unsigned char, 4>{51, 0, 255, 128};
        put_bytes(folder_ / "inks.jpg", test::ink_jpeg(inks, adobe));
        const Picture picture = read_picture(folder_ / "inks.jpg");
        EXPECT_EQ(picture.image.space(), ColourSpace::srgb);
        EXPECT_EQ(picture.remarks.size(), 1U);
        const float key = 1.0F - 128.0F / 255.0F;
        EXPECT_NEAR(picture.image.at(0, 4, 4), 0.8F * key, 0.01F) << adobe;
        EXPECT_NEAR(picture.image.at(1, 4, 4), key, 0.01F) << adobe;
        EXPECT_NEAR(picture.image.at(2, 4, 4), 0.0F, 0.01F) << adobe;
        EXPECT_EQ(read_picture(folder_ / "inks.jpg", {{}, {}, {}, true}).image.planes(), 4);
    }
}

TEST_F(ColourProfile, CamerasSayAdobeRgbInExif) {
    Image image({8, 8}, 3, ColourSpace::srgb);
    for (float& v : image.plane(1)) v = 1.0F;
    write_picture(folder_ / "plain.jpg", image);
    // Three lists of one tag each: to EXIF, to interoperability, and its index.
    using test::little_endian;
    const auto list = [](std::uint32_t tag, std::uint32_t type, std::uint32_t count,
                         const std::string& value) {
        return little_endian(1, 2) + little_endian(tag, 2) + little_endian(type, 2) + little_endian(count) +
               value + little_endian(0);
    };
    const std::string exif = std::string("II*\0", 4) + little_endian(8) +
                             list(0x8769, 4, 1, little_endian(26)) + list(0xA005, 4, 1, little_endian(44)) +
                             list(1, 2, 4, std::string("R03\0", 4));
    put_bytes(folder_ / "a.jpg", test::with_segments(test::bytes_of(folder_ / "plain.jpg"),
                                                     {{0xE1, std::string("Exif\0\0", 6) + exif}}));
    const Picture picture = read_picture(folder_ / "a.jpg");
    EXPECT_EQ(picture.remarks.size(), 1U);
    EXPECT_LT(picture.image.at(0, 4, 4), -0.1F);  // its green is beyond sRGB's
}

TEST_F(ColourProfile, ExrPrimariesAreConvertedAndComeBack) {
    OIIO::ImageSpec spec(1, 1, 3, OIIO::TypeDesc::FLOAT);
    std::array<float, 8> given{};
    for (std::size_t i = 0; i < 8; ++i) given.at(i) = static_cast<float>(display_p3.at(i));
    spec.attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8), given.data());
    test::write_foreign(folder_ / "a.exr", spec, std::vector<float>{0.0F, 1.0F, 0.0F});
    const Picture picture = read_picture(folder_ / "a.exr");
    EXPECT_EQ(picture.image.space(), ColourSpace::linear);
    EXPECT_EQ(picture.remarks.size(), 1U);
    const detail::Matrix3 m = detail::rec709_from(display_p3).value();
    for (std::size_t i = 0; i < 3; ++i)
        EXPECT_NEAR(picture.image.plane(static_cast<int>(i))[0], m[3 * i + 1], 1e-5);
    ASSERT_TRUE(picture.chromaticities);
    for (const char* name : {"b.exr", "b.hdr"}) {
        write_picture(folder_ / name, picture.image,
                      WriteOptions{picture.type, {}, false, picture.chromaticities});
        const Picture again = read_picture(folder_ / name);
        for (int p = 0; p < 3; ++p)
            EXPECT_NEAR(again.image.at(p, 0, 0), picture.image.at(p, 0, 0), 1e-2F) << name;
        ASSERT_TRUE(again.chromaticities) << name;
        EXPECT_NEAR((*again.chromaticities)[0], 0.68, 1e-5);
        // As they are stored: no value below 0 that HDR would cut.
        EXPECT_NEAR(read_picture(folder_ / name, {{}, {}, {}, true}).image.at(0, 0, 0), 0.0F, 1e-5F) << name;
    }
}

TEST_F(ColourProfile, ExrPrimariesOfColoursBesideOtherPlanes) {
    // In the order of their names: B, G, R, Z, and a layer.
    OIIO::ImageSpec spec(1, 1, 7, OIIO::TypeDesc::FLOAT);
    spec.channelnames = {"B", "G", "R", "Z", "a.B", "a.G", "a.R"};
    std::array<float, 8> primaries{};
    std::copy(display_p3.begin(), display_p3.end(), primaries.begin());
    spec.attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8), primaries.data());
    test::write_foreign(folder_ / "a.exr", spec,
                        std::vector<float>{0.0F, 1.0F, 0.0F, 7.5F, 0.0F, 0.5F, 0.0F});
    const Picture picture = read_picture(folder_ / "a.exr");
    const detail::Matrix3 m = detail::rec709_from(display_p3).value();
    const auto plane = [&](const std::string& name) {
        const auto& names = picture.image.names();
        const auto at = std::find(names.begin(), names.end(), name);
        EXPECT_NE(at, names.end()) << name;
        return static_cast<double>(picture.image.at(static_cast<int>(at - names.begin()), 0, 0));
    };
    EXPECT_NEAR(plane("R"), m[1], 1e-5);
    EXPECT_NEAR(plane("G"), m[4], 1e-5);
    EXPECT_NEAR(plane("B"), m[7], 1e-5);
    EXPECT_NEAR(plane("a.R"), 0.5 * m[1], 1e-5);
    EXPECT_EQ(plane("Z"), 7.5);
    EXPECT_EQ(picture.remarks.size(), 1U);
    ReadOptions two;
    two.planes = {"B", "R"};
    EXPECT_NE(read_picture(folder_ / "a.exr", two).remarks.at(0).find("stay in them"), std::string::npos);
}

TEST_F(ColourProfile, MatricesKeepWhiteAndInvert) {
    for (const Chromaticities& c :
         {display_p3, Chromaticities{0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767}}) {
        const detail::Matrix3 m = detail::rec709_from(c).value();
        for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(m[3 * i] + m[3 * i + 1] + m[3 * i + 2], 1.0, 1e-9);
    }
    const detail::Matrix3 same = detail::rec709_from(detail::rec709).value();
    for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(same[i], i % 4 == 0 ? 1.0 : 0.0, 1e-12);
    EXPECT_FALSE(detail::rec709_from({0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.3}));
    for (const double v : {-0.2, 0.0, 0.002, 0.0031308, 0.5, 1.7})
        EXPECT_NEAR(srgb_decoded(srgb_encoded(v)), v, 1e-12);
}

}  // namespace
}  // namespace btfield
