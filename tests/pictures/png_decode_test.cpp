// Every kind of PNG that there is, written by libpng.
#include <gtest/gtest.h>
#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

constexpr Size size{75, 13};  // higher than a strip of the reader, with rows that end within a byte

struct Kind {
    int colour, depth;
    bool interlaced, transparent;

    [[nodiscard]] int samples() const {
        return colour == PNG_COLOR_TYPE_RGB          ? 3
               : colour == PNG_COLOR_TYPE_RGB_ALPHA  ? 4
               : colour == PNG_COLOR_TYPE_GRAY_ALPHA ? 2
                                                     : 1;
    }
    [[nodiscard]] int top() const { return (1 << depth) - 1; }
};

int sample(const Kind& kind, int row, int column, int s) {
    return (row * 31 + column * 17 + s * 101 + (kind.depth == 16 ? row * column * 211 : 0)) & kind.top();
}

/// Of the one sample, or of the three, that tRNS makes transparent.
bool is_key(const Kind& kind, int row, int column) {
    for (int s = 0; s < kind.samples(); ++s)
        if (sample(kind, row, column, s) != sample(kind, 2, 3, s)) return false;
    return true;
}

std::array<std::uint8_t, 3> palette_colour(int index) {
    return {static_cast<std::uint8_t>(index * 7), static_cast<std::uint8_t>(255 - index),
            static_cast<std::uint8_t>(index ^ 90)};
}

void append(png_structp png, png_bytep from, std::size_t count) {
    static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(from), count);
}

std::string png_of(const Kind& kind) {
    std::string bytes;
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    png_set_write_fn(png, &bytes, &append, [](png_structp) {});
    png_set_IHDR(png, info, size.width, size.height, kind.depth, kind.colour,
                 kind.interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    std::vector<png_color> palette;
    std::vector<png_byte> alphas;
    if (kind.colour == PNG_COLOR_TYPE_PALETTE) {
        for (int i = 0; i <= kind.top(); ++i) {
            const auto [red, green, blue] = palette_colour(i);
            palette.push_back({red, green, blue});
            alphas.push_back(static_cast<png_byte>(255 - i));
        }
        png_set_PLTE(png, info, palette.data(), kind.top() + 1);
        if (kind.transparent) png_set_tRNS(png, info, alphas.data(), kind.top() + 1, nullptr);
    } else if (kind.transparent) {
        png_color_16 key{};
        key.gray = key.red = static_cast<png_uint_16>(sample(kind, 2, 3, 0));
        key.green = static_cast<png_uint_16>(sample(kind, 2, 3, 1));
        key.blue = static_cast<png_uint_16>(sample(kind, 2, 3, 2));
        png_set_tRNS(png, info, nullptr, 0, &key);
    }
    png_write_info(png, info);
    png_set_packing(png);
    const std::size_t sample_bytes = kind.depth == 16 ? 2 : 1;
    std::vector<std::uint8_t> row(static_cast<std::size_t>(size.width * kind.samples()) * sample_bytes);
    const int passes = png_set_interlace_handling(png);
    for (int pass = 0; pass < passes; ++pass)
        for (int r = 0; r < size.height; ++r) {
            std::size_t at = 0;
            for (int c = 0; c < size.width; ++c)
                for (int s = 0; s < kind.samples(); ++s) {
                    const int value = sample(kind, r, c, s);
                    if (kind.depth == 16) row[at++] = static_cast<std::uint8_t>(value >> 8);
                    row[at++] = static_cast<std::uint8_t>(value & 255);
                }
            png_write_row(png, row.data());
        }
    png_write_end(png, nullptr);
    png_destroy_write_struct(&png, &info);
    return bytes;
}

void put(const fs::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
}

void expect_pixel(const Kind& kind, const Picture& picture, Crop crop, int r, int c) {
    const int row = crop.y + r, column = crop.x + c;
    const auto top = static_cast<float>(kind.top());
    const int planes = picture.image.planes();
    for (int p = 0; p < planes; ++p) {
        float expected = static_cast<float>(sample(kind, row, column, p)) / top;
        if (kind.colour == PNG_COLOR_TYPE_PALETTE)
            expected = static_cast<float>(
                           palette_colour(sample(kind, row, column, 0)).at(static_cast<std::size_t>(p))) /
                       255.0F;
        EXPECT_FLOAT_EQ(picture.image.at(p, r, c), expected) << row << ',' << column << ',' << p;
    }
    if (picture.alpha.empty()) return;
    const float alpha = picture.alpha[static_cast<std::size_t>(r * crop.width + c)];
    if (kind.colour == PNG_COLOR_TYPE_PALETTE)
        EXPECT_FLOAT_EQ(alpha, static_cast<float>(255 - sample(kind, row, column, 0)) / 255.0F);
    else if (kind.transparent)
        EXPECT_EQ(alpha, is_key(kind, row, column) ? 0.0F : 1.0F) << row << ',' << column;
    else
        EXPECT_FLOAT_EQ(alpha, static_cast<float>(sample(kind, row, column, kind.samples() - 1)) / top);
}

TEST(png_decode, every_kind_of_pixels) {
    const TemporaryFolder folder;
    std::vector<Kind> kinds;
    for (const bool interlaced : {false, true}) {
        for (const bool transparent : {false, true}) {
            for (const int depth : {1, 2, 4, 8, 16})
                kinds.push_back({PNG_COLOR_TYPE_GRAY, depth, interlaced, transparent});
            for (const int depth : {1, 2, 4, 8})
                kinds.push_back({PNG_COLOR_TYPE_PALETTE, depth, interlaced, transparent});
            for (const int depth : {8, 16})
                kinds.push_back({PNG_COLOR_TYPE_RGB, depth, interlaced, transparent});
        }
        for (const int depth : {8, 16})
            for (const int colour : {PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB_ALPHA})
                kinds.push_back({colour, depth, interlaced, false});
    }
    for (const Kind& kind : kinds) {
        SCOPED_TRACE("colour type " + std::to_string(kind.colour) + ", " + std::to_string(kind.depth) +
                     " bits" + (kind.interlaced ? ", interlaced" : "") + (kind.transparent ? ", tRNS" : ""));
        put(folder / "a.png", png_of(kind));
        for (const Crop crop : {Crop{0, 0, size.width, size.height}, Crop{3, 60, 7, 11}}) {
            testing::internal::CaptureStderr();
            const Picture picture = read_picture(folder / "a.png", crop);
            EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
            const bool grey = kind.colour == PNG_COLOR_TYPE_GRAY || kind.colour == PNG_COLOR_TYPE_GRAY_ALPHA;
            EXPECT_EQ(picture.image.planes(), grey ? 1 : 3);
            EXPECT_EQ(picture.type, kind.depth == 16 ? PixelType::uint16 : PixelType::uint8);
            EXPECT_EQ(picture.image.plane_space(0), ColourSpace::srgb);
            const bool alpha = kind.transparent || (kind.colour & PNG_COLOR_MASK_ALPHA) != 0;
            EXPECT_EQ(picture.alpha.empty(), !alpha);
            EXPECT_TRUE(picture.remarks.empty());
            for (int r = 0; r < crop.height; ++r)
                for (int c = 0; c < crop.width; ++c) expect_pixel(kind, picture, crop, r, c);
        }
    }
}

/// Puts four bytes of a number, and the sum of the chunk that they are in.
void put_number(std::string& bytes, std::size_t at, std::uint32_t value) {
    for (int i = 0; i < 4; ++i)
        bytes[at + static_cast<std::size_t>(i)] = static_cast<char>(value >> (24 - 8 * i));
}

TEST(png_decode, fewer_pixels_than_the_header_says) {
    const TemporaryFolder folder;
    for (const bool interlaced : {false, true}) {
        std::string bytes = png_of({PNG_COLOR_TYPE_RGB, 8, interlaced, false});
        constexpr std::size_t header_at = 12, header_bytes = 17, height_at = 20;
        put_number(bytes, height_at, 2 * size.height);
        const auto sum = static_cast<std::uint32_t>(
            crc32(0, reinterpret_cast<const Bytef*>(bytes.data() + header_at), header_bytes));
        put_number(bytes, header_at + header_bytes, sum);
        const fs::path path = folder / "a.png";
        put(path, bytes);
        testing::internal::CaptureStderr();
        try {
            static_cast<void>(read_picture(path));
            ADD_FAILURE() << "read";
        } catch (const InputError& error) {
            EXPECT_EQ(error.found(), interlaced ? "its pixels cannot be decoded (bad adaptive filter value)"
                                                : "its pixels cannot be decoded (Not enough image data)");
        }
        EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
        if (interlaced) continue;
        // What is there can be read.
        EXPECT_EQ(read_picture(path, Crop{0, 0, size.width, size.height}).image.size(), size);
    }
}

std::string chunk(const std::string& name, const std::string& content) {
    std::string bytes(4, '\0');
    put_number(bytes, 0, static_cast<std::uint32_t>(content.size()));
    bytes += name + content + std::string(4, '\0');
    const auto sum = static_cast<std::uint32_t>(
        crc32(0, reinterpret_cast<const Bytef*>(bytes.data() + 4), static_cast<uInt>(bytes.size() - 8)));
    put_number(bytes, bytes.size() - 4, sum);
    return bytes;
}

TEST(png_decode, chunks_that_are_not_as_they_must_be) {
    const TemporaryFolder folder;
    const fs::path path = folder / "a.png";
    constexpr std::size_t behind_header = 33;
    const Kind kind{PNG_COLOR_TYPE_RGB, 8, false, false};
    const auto with = [&](std::size_t place, const std::string& more) {
        std::string bytes = png_of(kind);
        put(path, bytes.insert(place, more));
        return read_picture(path);
    };
    const Picture plain = with(0, "");
    const std::size_t before_end = png_of(kind).size() - 12;
    for (const auto& [place, name, content] :
         std::vector<std::tuple<std::size_t, std::string, std::string>>{{behind_header, "tRNS", "12"},
                                                                        {before_end, "tRNS", "123456"},
                                                                        {behind_header, "gAMA", "123"},
                                                                        {behind_header, "cHRM", "1"},
                                                                        {behind_header, "cICP", ""}}) {
        const Picture picture = with(place, chunk(name, content));
        EXPECT_TRUE(std::ranges::equal(picture.image.values(), plain.image.values())) << name;
        EXPECT_TRUE(picture.alpha.empty()) << name;
        EXPECT_EQ(picture.remarks,
                  std::vector<std::string>{"what its " + name +
                                           " says is damaged or out of place and was ignored"});
    }
    EXPECT_TRUE(with(behind_header, chunk("abCD", "xyz")).remarks.empty());
    try {
        static_cast<void>(with(behind_header, chunk("ABCD", "xyz")));
        ADD_FAILURE() << "read";
    } catch (const InputError& error) {
        EXPECT_EQ(error.found(),
                  "it is of a kind that is not supported (its chunk ABCD must not be ignored)");
    }
}

/// The picture with this as its only IDAT.
std::string with_pixels(const Kind& kind, const std::string& packed) {
    const std::string bytes = png_of(kind);
    return bytes.substr(0, bytes.find("IDAT") - 4) + chunk("IDAT", packed) + bytes.substr(bytes.size() - 12);
}

std::string deflated(const std::string& rows) {
    uLongf count = compressBound(static_cast<uLong>(rows.size()));
    std::string packed(count, '\0');
    EXPECT_EQ(compress(reinterpret_cast<Bytef*>(packed.data()), &count,
                       reinterpret_cast<const Bytef*>(rows.data()), static_cast<uLong>(rows.size())),
              Z_OK);
    packed.resize(count);
    return packed;
}

TEST(png_decode, pixels_that_go_on_behind_the_last_row) {
    const TemporaryFolder folder;
    const fs::path path = folder / "a.png";
    const std::string more = "its pixel data goes on behind its last row, and the rest was ignored";
    const Kind kind{PNG_COLOR_TYPE_GRAY, 8, false, false};
    std::string rows;
    for (int r = 0; r < size.height; ++r) {
        rows += '\0';  // no filter
        for (int c = 0; c < size.width; ++c) rows += static_cast<char>(sample(kind, r, c, 0));
    }
    const auto remarks = [&](const std::string& packed, std::optional<Crop> crop = {}) {
        put(path, with_pixels(kind, packed));
        const Picture picture = read_picture(path, crop);
        EXPECT_EQ(picture.image.at(0, 0, 7), static_cast<float>(sample(kind, 0, 7, 0)) / 255.0F);
        return picture.remarks;
    };
    EXPECT_TRUE(remarks(deflated(rows)).empty());
    EXPECT_EQ(remarks(deflated(rows + "x")), std::vector{more});
    EXPECT_EQ(remarks(deflated(rows) + "junk"), std::vector{more});
    EXPECT_EQ(remarks(deflated(rows + std::string(std::size_t{1} << 20, 'x'))), std::vector{more});
    // More than is unpacked.
    EXPECT_EQ(remarks(deflated(rows) + std::string(std::size_t{1} << 17, 'x')), std::vector{more});
    // What is not read is not looked at.
    EXPECT_TRUE(remarks(deflated(rows + "x"), Crop{0, 0, size.width, size.height - 1}).empty());
    std::string wrong = deflated(rows);
    wrong.back() = static_cast<char>(wrong.back() ^ 1);
    EXPECT_THROW(static_cast<void>(remarks(wrong)), InputError);
    // Nor does anything come behind the end mark.
    put(path, png_of({PNG_COLOR_TYPE_RGB, 8, false, false}) + "junk");
    EXPECT_EQ(read_picture(path).remarks,
              std::vector<std::string>{"4 bytes lie behind its end mark and belong to no picture"});
    // Interlaced rows end as others do.
    put(path, png_of({PNG_COLOR_TYPE_RGB, 8, true, false}));
    EXPECT_TRUE(read_picture(path).remarks.empty());
}

}  // namespace
}  // namespace btfield
