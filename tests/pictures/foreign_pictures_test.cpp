// Pictures as other programs write them: containers, tiles, profiles of inks, several pictures in one file.

#include <gtest/gtest.h>
#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/pictures/colour.hpp"
#include "host/pictures/container_chunks.hpp"
#include "host/pictures/exif.hpp"
#include "tests/foreign_bytes.hpp"
#include "tests/picture_bytes.hpp"
#include "tests/picture_files.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using test::big_endian;
using test::little_endian;
using test::put_bytes;

constexpr Chromaticities display_p3{0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290};

class ForeignPictures : public testing::Test {
  protected:
    Picture read(const std::string& name, const std::string& bytes) {
        put_bytes(folder_ / name, bytes);
        return read_picture(folder_ / name);
    }
    std::string refusal(const std::string& name, const std::string& bytes) {
        try {
            static_cast<void>(read(name, bytes));
        } catch (const InputError& error) {
            return error.what();
        }
        return {};
    }
    test::TemporaryFolder folder_;
};

/// Display P3 of these values as sRGB, values being encoded by `exponent`; by sRGB's curve without one.
std::array<double, 3> p3_as_srgb(const std::array<double, 3>& values, double exponent) {
    const detail::Matrix3 m = detail::rec709_from(display_p3).value();
    std::array<double, 3> result{};
    for (std::size_t i = 0; i < 3; ++i) {
        double light = 0.0;
        for (std::size_t k = 0; k < 3; ++k)
            light += m[3 * i + k] *
                     (exponent > 0.0 ? std::pow(values.at(k), exponent) : detail::srgb_decoded(values.at(k)));
        result.at(i) = detail::srgb_encoded(light);
    }
    return result;
}

void expect_pixel(const Image& image, const std::array<double, 3>& expected, double tolerance) {
    ASSERT_EQ(image.planes(), 3);
    for (int p = 0; p < 3; ++p)
        EXPECT_NEAR(image.at(p, 0, 0), expected.at(static_cast<std::size_t>(p)), tolerance) << p;
}

TEST_F(ForeignPictures, AnimatedPngIsItsFirstPictureWithAWord) {
    const std::string control = test::png_chunk("acTL", big_endian(2) + big_endian(0));
    const Picture picture = read("a.png", test::png_bytes({1, 2}, 0, "\x33\xff", control));
    EXPECT_EQ(picture.image.at(0, 0, 0), 0.2F);
    ASSERT_EQ(picture.remarks.size(), 1U);
    EXPECT_NE(picture.remarks[0].find("animated"), std::string::npos);
}

TEST_F(ForeignPictures, OfJpegsBehindEachOtherTheFirst) {
    // As cameras append a small copy, or the view of a second lens.
    const Image image = test::sampled({16, 24}, 3, ColourSpace::srgb, PixelType::uint8);
    write_picture(folder_ / "large.jpg", image);
    write_picture(folder_ / "small.jpg", test::sampled({8, 8}, 3, ColourSpace::srgb, PixelType::uint8));
    const std::string first = test::bytes_of(folder_ / "large.jpg");
    const Picture both = read("both.jpg", first + test::bytes_of(folder_ / "small.jpg"));
    EXPECT_EQ(both.image.size(), image.size());
    const Picture alone = read("one.jpg", first);
    const auto values = both.image.values();
    EXPECT_TRUE(std::equal(values.begin(), values.end(), alone.image.values().begin()));
}

TEST_F(ForeignPictures, InksAreConvertedByTheirProfile) {
    const std::string jpeg = test::ink_jpeg({128, 0, 0, 0}, false);
    const std::string head = std::string("ICC_PROFILE\0\1\1", 14);
    const Picture picture =
        read("a.jpg", test::with_segments(jpeg, {{0xE2, head + test::ink_profile_bytes()}}));
    const double grey = detail::srgb_encoded(std::pow((100.0 * (1.0 - 128.0 / 255.0) + 16.0) / 116.0, 3.0));
    expect_pixel(picture.image, {grey, grey, grey}, 5e-3);
    EXPECT_EQ(picture.image.space(), ColourSpace::srgb);
    EXPECT_EQ(picture.remarks.size(), 1U);
}

// --- Damage that fuzzing found

TEST_F(ForeignPictures, ExifThatEndsInsideItsMarkOfAdobeRgb) {
    const auto entry = [](std::uint32_t tag, std::uint32_t type, const std::string& value) {
        return little_endian(tag, 2) + little_endian(type, 2) + little_endian(1) + value;
    };
    std::string nested = "II*" + std::string(1, '\0') + little_endian(8);
    nested += little_endian(1, 2) + entry(0x8769, 4, little_endian(26)) + little_endian(0);
    nested += little_endian(1, 2) + entry(0xA005, 4, little_endian(44)) + little_endian(0);
    nested += little_endian(1, 2) + entry(1, 2, std::string("R03\0", 4));
    EXPECT_TRUE(detail::read_exif(nested).adobe_rgb);
    for (std::size_t cut = 0; cut + 1 < nested.size(); ++cut)
        EXPECT_FALSE(detail::read_exif(nested.substr(0, cut)).adobe_rgb && cut + 2 < nested.size()) << cut;
}

TEST_F(ForeignPictures, ProfilesOfNoKnownColoursArePassedOver) {
    const std::string good = test::profile_bytes(display_p3, 2.2);
    const std::string head = std::string("ICC_PROFILE\0\1\1", 14);
    write_picture(folder_ / "plain.jpg", test::sampled({8, 8}, 3, ColourSpace::srgb, PixelType::uint8));
    const std::string jpeg = test::bytes_of(folder_ / "plain.jpg");
    const Picture plain = read("plain.jpg", jpeg);
    // The name of its colours; and every tag's place and length, far beyond its end.
    for (const std::size_t at : {std::size_t{16}, std::size_t{128 + 4 + 4}, std::size_t{128 + 4 + 8}}) {
        std::string spoilt = good;
        spoilt.replace(at, 4, "\xae\xbe\xae\xae");
        const Picture picture = read("a.jpg", test::with_segments(jpeg, {{0xE2, head + spoilt}}));
        EXPECT_TRUE(std::isfinite(picture.image.at(0, 0, 0)));
        if (at == 16) {
            EXPECT_EQ(picture.remarks.size(), 1U);
            EXPECT_EQ(picture.image.at(0, 0, 0), plain.image.at(0, 0, 0));
        }
    }
}

TEST_F(ForeignPictures, TitlesOfProfilesAreShownWithoutTheirControlCharacters) {
    std::string profile = test::profile_bytes(display_p3, 2.2);
    const std::size_t title = profile.find(std::string("\0R\0G\0B", 6));
    ASSERT_NE(title, std::string::npos);
    profile[title + 1] = '\x7f';
    profile[title + 3] = '\x1b';
    write_picture(folder_ / "plain.jpg", test::sampled({8, 8}, 3, ColourSpace::srgb, PixelType::uint8));
    const std::string head = std::string("ICC_PROFILE\0\1\1", 14);
    const Picture picture =
        read("a.jpg", test::with_segments(test::bytes_of(folder_ / "plain.jpg"), {{0xE2, head + profile}}));
    ASSERT_EQ(picture.remarks.size(), 1U);
    EXPECT_NE(picture.remarks[0].find("'"), std::string::npos) << picture.remarks[0];
    for (const char c : picture.remarks[0])
        EXPECT_TRUE(static_cast<unsigned char>(c) >= 0x20 && c != '\x7f') << picture.remarks[0];
}

TEST_F(ForeignPictures, JpegHeadersThatCannotBeAreRefused) {
    const std::string good = test::ink_jpeg({1, 2, 3, 4}, true);
    const std::size_t frame = good.find("\xff\xc0");
    ASSERT_NE(frame, std::string::npos);
    // Height and width of more than the file can hold; then two components.
    std::string huge = good, two = good;
    huge.replace(frame + 5, 4, "\xff\xdc\xff\xdc");
    two[frame + 9] = 2;
    EXPECT_NE(refusal("a.jpg", huge).find("cannot hold"), std::string::npos);
    EXPECT_NE(refusal("b.jpg", two).find("b.jpg"), std::string::npos);
    for (std::size_t i = 2; i < good.size(); ++i) {
        std::string spoilt = good;
        spoilt[i] = static_cast<char>(spoilt[i] ^ 0xff);
        static_cast<void>(refusal("c.jpg", spoilt));
    }
}

TEST_F(ForeignPictures, TiffColoursOfTooFewSamplesAreRefused) {
    const std::string pixels(64, '\x55');
    for (const int photometric : {6, 8, 9, 32845})
        for (const std::uint16_t samples : {std::uint16_t{1}, std::uint16_t{2}}) {
            const std::vector<std::uint16_t> bits(samples, 8);
            const std::string bytes = test::tiff_bytes(
                {4, 4}, {{258, bits}, {262, {static_cast<std::uint16_t>(photometric)}}, {277, {samples}}},
                pixels);
            EXPECT_NE(refusal("a.tif", bytes), "") << photometric << ", " << samples;
        }
    // Extra samples are none of the three.
    const std::string extra =
        test::tiff_bytes({2, 2}, {{258, {8, 8, 8}}, {262, {8}}, {277, {3}}, {338, {0}}}, pixels);
    EXPECT_NE(refusal("b.tif", extra).find("take 3 samples"), std::string::npos) << refusal("b.tif", extra);
}

// --- TIFF

/// What libtiff is told of a picture of 24 x 17 pixels whose planes hold 8 bits, and how it is cut up.
struct TiffShape {
    bool tiled, apart;
};

std::string tiff_of(const std::filesystem::path& path, const Image& image, TiffShape shape,
                    const std::function<void(TIFF*)>& tell = {}) {
    TIFF* const file = TIFFOpen(path.c_str(), "w");
    const auto planes = static_cast<std::uint16_t>(image.planes());
    TIFFSetField(file, TIFFTAG_IMAGEWIDTH, image.width());
    TIFFSetField(file, TIFFTAG_IMAGELENGTH, image.height());
    TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, planes);
    TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, 8);
    TIFFSetField(file, TIFFTAG_COMPRESSION, COMPRESSION_LZW);
    TIFFSetField(file, TIFFTAG_PHOTOMETRIC, planes == 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
    TIFFSetField(file, TIFFTAG_PLANARCONFIG, shape.apart ? PLANARCONFIG_SEPARATE : PLANARCONFIG_CONTIG);
    const int side = shape.tiled ? 16 : 5;
    if (shape.tiled) {
        TIFFSetField(file, TIFFTAG_TILEWIDTH, 16);
        TIFFSetField(file, TIFFTAG_TILELENGTH, 16);
    } else {
        TIFFSetField(file, TIFFTAG_ROWSPERSTRIP, side);
    }
    if (tell) tell(file);
    const int layers = shape.apart ? planes : 1, width = shape.tiled ? 16 : image.width();
    for (int layer = 0; layer < layers; ++layer)
        for (int top = 0; top < image.height(); top += side)
            for (int left = 0; left < image.width(); left += width) {
                std::vector<unsigned char> block;
                const int rows = shape.tiled ? side : std::min(side, image.height() - top);
                for (int r = top; r < top + rows; ++r)
                    for (int c = left; c < left + width; ++c)
                        for (int p = 0; p < planes; ++p) {
                            if (shape.apart && p != layer) continue;
                            const bool inside = r < image.height() && c < image.width();
                            block.push_back(
                                inside ? static_cast<unsigned char>(std::lround(255.0F * image.at(p, r, c)))
                                       : 9);
                        }
                const auto sample = static_cast<std::uint16_t>(layer);
                const auto column = static_cast<std::uint32_t>(left), row = static_cast<std::uint32_t>(top);
                const auto bytes = static_cast<tmsize_t>(block.size());
                if (shape.tiled) {
                    TIFFWriteEncodedTile(file, TIFFComputeTile(file, column, row, 0, sample), block.data(),
                                         bytes);
                } else {
                    TIFFWriteEncodedStrip(file, TIFFComputeStrip(file, row, sample), block.data(), bytes);
                }
            }
    TIFFClose(file);
    return test::bytes_of(path);
}

TEST_F(ForeignPictures, TiffOfStripsAndTilesOfPlanesBesideEachOtherAndApart) {
    for (const int planes : {1, 3, 5})
        for (const TiffShape shape : {TiffShape{false, false}, TiffShape{false, true}, TiffShape{true, false},
                                      TiffShape{true, true}}) {
            const Image image = test::sampled({17, 24}, planes, ColourSpace::unspecified, PixelType::uint8);
            tiff_of(folder_ / "a.tif", image, shape);
            const auto found = read_picture(folder_ / "a.tif").image;
            ASSERT_EQ(found.size(), image.size());
            ASSERT_EQ(found.planes(), planes);
            EXPECT_TRUE(std::equal(found.values().begin(), found.values().end(), image.values().begin()))
                << planes << " planes, " << (shape.tiled ? "tiles, " : "strips, ")
                << (shape.apart ? "apart" : "");
            // A crop that begins and ends inside of blocks.
            const auto part = read_picture(folder_ / "a.tif", Crop{7, 3, 12, 13}).image;
            const Image expected = image.crop(3, 7, {13, 12});
            EXPECT_TRUE(std::equal(part.values().begin(), part.values().end(), expected.values().begin()));
        }
}

TEST_F(ForeignPictures, XmpTurnsWhereExifIsSilent) {
    const std::string key("XML:com.adobe.xmp\0", 18);
    const std::string packet = "<x:xmpmeta><rdf:Description tiff:Orientation=\"6\"/></x:xmpmeta>";
    const std::string element = "<tiff:Orientation>6</tiff:Orientation>";
    const auto png = [&](const std::string& chunks) {
        return read("a.png", test::png_bytes({1, 2}, 0, "\x10\x20", chunks));
    };
    for (const std::string& content :
         {key + std::string(4, '\0') + packet, key + std::string(4, '\0') + element,
          key + std::string("\1\0\0\0", 4) + test::deflated(packet)}) {
        const Picture turned = png(test::png_chunk("iTXt", content));
        EXPECT_EQ(turned.image.size(), (Size{2, 1}));
        ASSERT_EQ(turned.remarks.size(), 1U);
        EXPECT_NE(turned.remarks[0].find("XMP"), std::string::npos);
    }
    const Picture silent = png(test::png_chunk("iTXt", key + std::string(4, '\0') + packet) +
                               test::png_chunk("eXIf", test::exif_bytes(1)));
    EXPECT_EQ(silent.image.size(), (Size{1, 2}));
    EXPECT_TRUE(silent.remarks.empty());
    EXPECT_EQ(png(test::png_chunk("iTXt", key)).image.size(), (Size{1, 2}));  // damaged
}

TEST_F(ForeignPictures, TiffPrimariesAndProfileAreConverted) {
    Image image({17, 24}, 3, ColourSpace::srgb);
    const std::array<double, 3> values{200 / 255.0, 100 / 255.0, 50 / 255.0};
    for (int p = 0; p < 3; ++p)
        for (float& v : image.plane(p)) v = static_cast<float>(values.at(static_cast<std::size_t>(p)));
    tiff_of(folder_ / "a.tif", image, {false, false}, [](TIFF* file) {
        std::array<float, 2> white{0.3127F, 0.3290F};
        std::array<float, 6> primaries{0.680F, 0.320F, 0.265F, 0.690F, 0.150F, 0.060F};
        TIFFSetField(file, TIFFTAG_WHITEPOINT, white.data());
        TIFFSetField(file, TIFFTAG_PRIMARYCHROMATICITIES, primaries.data());
    });
    expect_pixel(read_picture(folder_ / "a.tif").image, p3_as_srgb(values, 0.0), 1e-4);
    tiff_of(folder_ / "b.tif", image, {true, false}, [](TIFF* file) {
        const std::string profile = test::profile_bytes(display_p3, 2.2);
        TIFFSetField(file, TIFFTAG_ICCPROFILE, static_cast<std::uint32_t>(profile.size()), profile.data());
    });
    expect_pixel(read_picture(folder_ / "b.tif").image, p3_as_srgb(values, 2.2), 3e-4);
}

// --- WebP and HEIF

std::string riff_chunk(const std::string& name, std::string content) {
    const auto size = static_cast<std::uint32_t>(content.size());
    if (content.size() % 2 != 0) content += '\0';
    return name + little_endian(size) + content;
}

TEST_F(ForeignPictures, WebpProfileExifAndAlpha) {
    OIIO::ImageSpec spec(2, 1, 4, OIIO::TypeDesc::UINT8);
    spec.attribute("compression", "lossless");
    test::write_foreign(
        folder_ / "a.webp", spec,
        std::vector<float>{200.0F / 255, 100.0F / 255, 50.0F / 255, 1.0F, 0.1F, 0.1F, 0.1F, 0.2F});
    const std::string plain = test::bytes_of(folder_ / "a.webp");
    const Picture alone = read("a.webp", plain);
    ASSERT_EQ(alone.alpha.size(), 2U);
    EXPECT_EQ(alone.alpha[1], 0.2F);
    // Flags (profile 32, alpha 16, EXIF 8), then width and height less one.
    const std::size_t pixels = plain.find("VP8L");
    ASSERT_NE(pixels, std::string::npos);
    const std::string canvas =
        std::string(1, '\x38') + std::string(3, '\0') + little_endian(1, 3) + little_endian(0, 3);
    const std::string content = "WEBP" + riff_chunk("VP8X", canvas) +
                                riff_chunk("ICCP", test::profile_bytes(display_p3, 2.2)) +
                                plain.substr(pixels) + riff_chunk("EXIF", test::exif_bytes(6));
    const Picture picture = read("b.webp", riff_chunk("RIFF", content));
    EXPECT_EQ(picture.image.size(), (Size{2, 1}));
    const std::array<double, 3> stored{alone.image.at(0, 0, 0), alone.image.at(1, 0, 0),
                                       alone.image.at(2, 0, 0)};
    expect_pixel(picture.image, p3_as_srgb(stored, 2.2), 3e-4);
    ASSERT_EQ(picture.alpha.size(), 2U);
    EXPECT_EQ(picture.alpha[1], 0.2F);
    const std::string silent = "WEBP" + riff_chunk("VP8X", std::string(1, '\x14') + canvas.substr(1)) +
                               plain.substr(pixels) +
                               riff_chunk("XMP ", "<tiff:Orientation>6</tiff:Orientation>");
    EXPECT_EQ(read("c.webp", riff_chunk("RIFF", silent)).image.size(), (Size{2, 1}));
}

std::string box(const std::string& name, const std::string& content) {
    return big_endian(static_cast<std::uint32_t>(content.size() + 8)) + name + content;
}

std::string full_box(const std::string& name, const std::string& content, int version = 0) {
    return box(name, big_endian(static_cast<std::uint32_t>(version) << 24) + content);
}

std::string nclx(int primaries, int transfer) {
    return box("colr", "nclx" + big_endian(static_cast<std::uint32_t>(primaries), 2) +
                           big_endian(static_cast<std::uint32_t>(transfer), 2) + big_endian(6, 2) + '\x80');
}

/// A HEIF whose first picture is item 2, with the properties of these numbers.
std::string heif_bytes(const std::string& properties, const std::string& numbers) {
    const std::string associations = big_endian(2) + big_endian(1, 2) + "\1\1" + big_endian(2, 2) +
                                     static_cast<char>(numbers.size()) + numbers;
    return box("ftyp", "heicxxxx") +
           full_box("meta", full_box("pitm", big_endian(2, 2)) +
                                box("iprp", box("ipco", properties) + full_box("ipma", associations)));
}

TEST_F(ForeignPictures, HeifColoursAreThoseOfItsFirstPicture) {
    const std::string properties =
        nclx(1, 13) + box("ispe", "xxxx") + box("colr", "profPROFILE") + nclx(12, 16);
    // Essential properties have the first bit set.
    const detail::ContainerChunks first = detail::heif_chunks(heif_bytes(properties, "\2\x83"));
    EXPECT_EQ(first.profile, "PROFILE");
    EXPECT_EQ(first.code_points, "");
    const detail::ContainerChunks both = detail::heif_chunks(heif_bytes(properties, "\4\3"));
    EXPECT_EQ(both.profile, "PROFILE");
    EXPECT_EQ(both.code_points, "\x0c\x10");
    // Of none: the first that there are.
    const detail::ContainerChunks any = detail::heif_chunks(heif_bytes(properties, "\2"));
    EXPECT_EQ(any.profile, "PROFILE");
    EXPECT_EQ(any.code_points, "\1\x0d");
    const std::string whole = heif_bytes(properties, "\2\x83");
    for (std::size_t cut = 0; cut < whole.size(); ++cut)
        EXPECT_LE(detail::heif_chunks(whole.substr(0, cut)).profile.size(), 7U);
}

TEST_F(ForeignPictures, HeicIsConvertedByWhatItSaysOfItsColours) {
    const std::string bytes = test::bytes_of(test::data_folder() + "/orange.heic");
    const std::size_t at = bytes.find("colrnclx");
    ASSERT_NE(at, std::string::npos);
    const auto saying = [&](int primaries, int transfer) {
        std::string changed = bytes;
        changed[at + 9] = static_cast<char>(primaries);
        changed[at + 11] = static_cast<char>(transfer);
        return changed;
    };
    const Picture plain = read("b.heic", saying(1, 13)), unsaid = read("u.heic", saying(2, 2));
    EXPECT_TRUE(plain.remarks.empty());
    EXPECT_TRUE(unsaid.remarks.empty());
    const std::array<double, 3> stored{plain.image.at(0, 0, 0), plain.image.at(1, 0, 0),
                                       plain.image.at(2, 0, 0)};
    expect_pixel(unsaid.image, stored, 0.0);
    EXPECT_NEAR(stored[0], 200 / 255.0, 0.02);
    const Picture wide = read("c.heic", saying(12, 13));
    expect_pixel(wide.image, p3_as_srgb(stored, 0.0), 1e-4);
    EXPECT_EQ(wide.remarks.size(), 1U);
    EXPECT_NE(refusal("d.heic", saying(9, 16)).find("PQ"), std::string::npos);
    const Picture profiled = read_picture(test::data_folder() + "/orange-p3.heic");
    expect_pixel(profiled.image, p3_as_srgb(stored, 2.2), 0.01);
}

}  // namespace
}  // namespace btfield
