// Pictures, and what stands in their files beside the pixels.

#include <zlib.h>

#include <cmath>
#include <fstream>

#include "btfield/control_field.hpp"
#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/pictures/colour_profile.hpp"
#include "host/pictures/container_chunks.hpp"
#include "host/pictures/exif.hpp"
#include "host/pictures/picture_format.hpp"
#include "tests/foreign_bytes.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/picture_bytes.hpp"
#include "tests/picture_files.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield::test {
namespace {

constexpr Chromaticities display_p3{0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290};

void check_picture(const Picture& picture) {
    const Image& image = picture.image;
    demand(image.width() > 0 && image.height() > 0 && image.planes() > 0, "a picture without pixels");
    for (const float value : image.values()) demand(std::isfinite(value), "a value that is no number");
    demand(picture.alpha.empty() || picture.alpha.size() == area(image.size()), "alpha of another size");
    for (const std::string& remark : picture.remarks) check_message(remark);
}

std::optional<detail::PictureFormat> format_of(std::string_view bytes) {
    return detail::format_of_bytes(bytes.substr(0, 16));
}

/// Whole, and as its numbers are.
void read_whole(std::string_view bytes) {
    const std::filesystem::path& file = file_with(bytes);
    check_picture(read_picture(file));
    ReadOptions options;
    options.keep_values = true;
    check_picture(read_picture(file, options));
}

template <detail::PictureFormat format>
void read_only(std::string_view bytes) {
    if (format_of(bytes) == format) read_whole(bytes);
}

std::vector<std::string> written(const std::vector<std::string>& names, PixelType type, int planes,
                                 Size size = {6, 9}) {
    std::vector<std::string> all;
    const TemporaryFolder folder;
    for (const std::string& name : names) {
        const bool integer = type == PixelType::uint8 || type == PixelType::uint16;
        Image image = sampled(size, planes,
                              planes != 3 ? ColourSpace::unspecified
                              : integer   ? ColourSpace::srgb
                                          : ColourSpace::linear,
                              type);
        write_picture(folder / name, image, type, type);
        all.push_back(bytes_of(folder / name));
    }
    return all;
}

std::vector<std::string> joined(const std::vector<std::vector<std::string>>& lists) {
    std::vector<std::string> all;
    for (const auto& list : lists) all.insert(all.end(), list.begin(), list.end());
    return all;
}

std::vector<std::string> pnm_seeds() {
    return joined({{"P1\n# bits\n3 2\n1 0 1\n0 1 0\n", "P2 2 2 9 1 2 3 4", "P3 1 1 65535 1 20 300\n",
                    std::string("P4 9 2\n\x80\x00\xff\x80", 12)},
                   written({"a.pgm"}, PixelType::uint8, 1),
                   written({"a.ppm"}, PixelType::uint16, 3)});
}

std::vector<std::string> radiance_seeds() {
    std::vector<std::string> seeds = written({"a.hdr"}, PixelType::float32, 3, {3, 12});
    const std::string pixel = "\x40\x50\x60\x80";
    const std::string flat = pixel + pixel + std::string("\1\1\1\2", 4) + pixel;
    seeds.push_back(
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\nGAMMA=2.2\nCOLORCORR=1 2 1\n\n-Y 1 +X 5\n" + flat);
    seeds.push_back(
        "#?RGBE\n# old\nPRIMARIES=0.68 0.32 0.265 0.69 0.15 0.06 0.3127 0.329\nFORMAT=32-bit_rle_xyze\n\n+X "
        "1 "
        "-Y 5\n" +
        flat);
    return seeds;
}

std::vector<std::string> png_seeds() {
    const std::string grey(12, '\x50'), rgb(36, '\x70');
    const std::string header16 =
        png_chunk("gAMA", big_endian(45455)) + png_chunk("sRGB", std::string(1, '\0'));
    std::string cicp = png_chunk("cICP", std::string("\x0c\x0d\0\1", 4));
    std::string primaries;
    for (const std::uint32_t v : {31270U, 32900U, 68000U, 32000U, 26500U, 69000U, 15000U, 6000U})
        primaries += big_endian(v);
    const std::string profile = std::string("name\0\0", 6) + deflated(profile_bytes(display_p3, 2.2));
    return joined(
        {{png_bytes({3, 4}, 0, grey), png_bytes({3, 4}, 2, rgb, header16), png_bytes({3, 4}, 2, rgb, cicp),
          png_bytes({3, 4}, 2, rgb, png_chunk("cHRM", primaries) + png_chunk("eXIf", exif_bytes(6))),
          png_bytes({3, 4}, 2, rgb, png_chunk("iCCP", profile)),
          png_bytes({3, 4}, 2, rgb, png_chunk("tEXt", std::string("Comment\0btfield", 15)))},
         written({"a.png"}, PixelType::uint16, 3)});
}

/// Every chunk's checksum.
void repair_png(std::uint8_t* bytes, std::size_t size) {
    const auto number = [&](std::size_t at) {
        return std::uint32_t{bytes[at]} << 24 | std::uint32_t{bytes[at + 1]} << 16 |
               std::uint32_t{bytes[at + 2]} << 8 | bytes[at + 3];
    };
    for (std::size_t at = 8; at + 12 <= size;) {
        const std::size_t length = number(at);
        if (length > size - at - 12) return;
        const auto sum =
            static_cast<std::uint32_t>(::crc32(0, bytes + at + 4, static_cast<uInt>(length + 4)));
        for (std::size_t i = 0; i < 4; ++i)
            bytes[at + 8 + length + i] = static_cast<std::uint8_t>(sum >> (24 - 8 * i));
        at += 12 + length;
    }
}

constexpr std::array<PaletteColour, 3> palette{{{0, 0, 0}, {255, 0, 0}, {80, 80, 80}}};

void read_label_picture(std::string_view bytes) {
    if (format_of(bytes) == detail::PictureFormat::png) check(read_labels(file_with(bytes), palette));
}

std::vector<std::string> label_picture_seeds() {
    const std::string colours = png_chunk("PLTE", std::string("\0\0\0\xff\0\0\x50\x50\x50", 9));
    std::vector<std::string> seeds{
        png_bytes({2, 3}, 3, std::string("\0\1\2\2\1\0", 6), colours),
        png_bytes({2, 3}, 3, std::string("\0\1\2\2\1\0", 6), colours + png_chunk("tRNS", "\xff\xff"))};
    seeds.push_back(png_bytes({2, 3}, 0, std::string("\0\1\2\2\1\0", 6)));
    seeds.push_back(png_bytes({1, 2}, 2, std::string("\xff\0\0\x50\x50\x50", 6)));
    return seeds;
}

std::vector<std::string> jpeg_seeds() {
    std::vector<std::string> seeds = joined(
        {written({"a.jpg"}, PixelType::uint8, 3, {8, 16}), written({"a.jpg"}, PixelType::uint8, 1, {8, 8})});
    const std::string profile = profile_bytes(display_p3, 2.2);
    seeds.push_back(with_segments(seeds[0], {{0xE1, std::string("Exif\0\0", 6) + exif_bytes(8)},
                                             {0xE2, std::string("ICC_PROFILE\0\1\1", 14) + profile}}));
    seeds.push_back(ink_jpeg({204, 255, 0, 127}, true));
    seeds.push_back(ink_jpeg({51, 0, 255, 128}, false));
    return seeds;
}

std::vector<std::string> tiff_seeds() {
    std::vector<std::string> seeds =
        joined({written({"a.tif"}, PixelType::uint8, 3), written({"a.tif"}, PixelType::uint16, 1),
                written({"a.tif"}, PixelType::half, 4), written({"a.tif"}, PixelType::float32, 2)});
    using Words = std::vector<std::uint16_t>;
    const std::string twelve(12, '\x55');
    const auto kind = [&](Words bits, std::uint16_t photometric, std::vector<TiffTag> more, Size size) {
        more.push_back({258, bits});
        more.push_back({262, {photometric}});
        more.push_back({277, {static_cast<std::uint16_t>(bits.size())}});
        seeds.push_back(tiff_bytes(size, more, twelve));
    };
    kind({8}, 0, {{274, {6}}}, {3, 4});                    // white is 0, turned
    kind({1}, 1, {}, {3, 8});                              // bits
    kind({8}, 1, {{339, {2}}}, {3, 4});                    // signed
    kind({8, 8, 8}, 8, {}, {2, 2});                        // CIELab
    kind({8, 8, 8, 8}, 5, {{332, {1}}}, {1, 3});           // CMYK
    kind({8, 8, 8, 8}, 2, {{338, {2}}}, {1, 3});           // alpha
    kind({8, 8, 8}, 2, {{284, {2}}, {274, {5}}}, {2, 2});  // planes apart
    kind({8}, 3, {{320, Words(768, 0x8000)}}, {3, 4});     // palette
    kind({8, 8, 8}, 6, {{530, {1, 1}}}, {2, 2});           // YCbCr
    kind({8}, 1, {{254, {1}}}, {3, 4});                    // a reduced copy
    return seeds;
}

void read_profile(std::string_view bytes) {
    for (const int planes : {1, 3, 4}) {
        for (const PixelType type : {PixelType::uint8, PixelType::float32}) {
            Picture picture;
            picture.image = Image({1, 2}, planes);
            picture.type = type;
            for (float& value : picture.image.values()) value = 0.25F;
            detail::ColourMeaning meaning;
            meaning.profile = std::string(bytes);
            detail::apply_meaning(picture, meaning, false);
            for (const std::string& remark : picture.remarks) check_message(remark);
        }
    }
}

std::vector<std::string> profile_seeds() {
    return {profile_bytes(display_p3, 2.2), profile_bytes({}, 1.8), srgb_profile_bytes()};
}

void read_exif_block(std::string_view bytes) {
    const detail::Exif exif = detail::read_exif(bytes);
    demand(exif.orientation >= 1 && exif.orientation <= 8, "an orientation that there is not");
}

/// A list that leads to a list that leads to the mark of Adobe RGB.
std::vector<std::string> exif_seeds() {
    const auto entry = [](std::uint32_t tag, std::uint32_t type, const std::string& value) {
        return little_endian(tag, 2) + little_endian(type, 2) + little_endian(1) + value;
    };
    std::string nested = "II*" + std::string(1, '\0') + little_endian(8);
    nested += little_endian(1, 2) + entry(0x8769, 4, little_endian(26)) + little_endian(0);
    nested += little_endian(1, 2) + entry(0xA005, 4, little_endian(44)) + little_endian(0);
    nested += little_endian(1, 2) + entry(1, 2, std::string("R03\0", 4));
    return {exif_bytes(6), nested};
}

void read_containers(std::string_view bytes) {
    for (const detail::ContainerChunks& chunks : {detail::webp_chunks(bytes), detail::heif_chunks(bytes)}) {
        static_cast<void>(detail::read_exif(chunks.exif));
        demand(chunks.code_points.empty() || chunks.code_points.size() == 2, "code points are two bytes");
    }
}

std::vector<std::string> foreign_seeds() {
    std::vector<std::string> seeds;
    const TemporaryFolder folder;
    OIIO::ImageSpec spec(8, 8, 4, OIIO::TypeDesc::UINT8);
    spec.attribute("compression", "lossless");
    write_foreign(folder / "a.webp", spec, std::vector<float>(256, 0.3F));
    seeds.push_back(bytes_of(folder / "a.webp"));
    for (const char* name : {"/orange.heic", "/orange-p3.heic"})
        seeds.push_back(bytes_of(data_folder() + name));
    return seeds;
}

/// Whatever is read as a picture.
std::vector<std::string> picture_seeds() {
    return joined({written({"a.exr"}, PixelType::half, 3), written({"a.exr"}, PixelType::float32, 2),
                   png_seeds(), jpeg_seeds(), tiff_seeds(), pnm_seeds(), radiance_seeds()});
}

}  // namespace

std::vector<FuzzTarget> picture_targets() {
    using Format = detail::PictureFormat;
    return {{"pnm", &read_only<Format::pnm>, &pnm_seeds},
            {"radiance", &read_only<Format::hdr>, &radiance_seeds},
            {"png", &read_only<Format::png>, &png_seeds, &repair_png},
            {"label-picture", &read_label_picture, &label_picture_seeds, &repair_png},
            {"jpeg", &read_only<Format::jpeg>, &jpeg_seeds},
            {"tiff", &read_only<Format::tiff>, &tiff_seeds},
            {"profile", &read_profile, &profile_seeds},
            {"exif", &read_exif_block, &exif_seeds},
            {"containers", &read_containers, &foreign_seeds},
            {"pictures", &read_whole, &picture_seeds}};
}

}  // namespace btfield::test
