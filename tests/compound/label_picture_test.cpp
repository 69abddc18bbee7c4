// Control fields in files: what is written is a palette PNG and comes back; which pictures are read, and how;
// what is refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "btfield/control_field.hpp"
#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "tests/picture_files.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using test::bytes_of;
using test::put_bytes;
using test::TemporaryFolder;
using Palette = std::vector<PaletteColour>;
using Labels = std::vector<std::uint8_t>;

/// K colours, all different.
Palette palette_of(int regions) {
    Palette palette;
    for (int k = 0; k < regions; ++k) {
        palette.push_back({static_cast<std::uint8_t>(7 * k), static_cast<std::uint8_t>(255 - 3 * k),
                           static_cast<std::uint8_t>(91 * k % 256)});
    }
    return palette;
}

ControlField field_of(Size size, int regions) {
    ControlField field{size, regions, Labels(area(size))};
    for (std::size_t i = 0; i < field.labels.size(); ++i) {
        field.labels[i] = static_cast<std::uint8_t>((i * i + i / 5) % static_cast<std::size_t>(regions));
    }
    return field;
}

void expect_same(const ControlField& a, const ControlField& b, const std::string& what) {
    EXPECT_EQ(a.size, b.size) << what;
    EXPECT_EQ(a.regions, b.regions) << what;
    EXPECT_EQ(a.labels, b.labels) << what;
}

/// The labels' colours as a picture.
Image painted(const ControlField& field, const Palette& palette) {
    Image image(field.size, 3, ColourSpace::srgb);
    for (int p = 0; p < 3; ++p) {
        for (std::size_t i = 0; i < field.labels.size(); ++i) {
            image.plane(p)[i] =
                static_cast<float>(palette[field.labels[i]][static_cast<std::size_t>(p)]) / 255.0F;
        }
    }
    return image;
}

Image grey(const ControlField& field) {
    Image image(field.size, 1);
    std::transform(field.labels.begin(), field.labels.end(), image.values().begin(),
                   [](std::uint8_t label) { return static_cast<float>(label) / 255.0F; });
    return image;
}

// --- PNG by hand
// -------------------------------------------------------------------------------------------------------

std::string big_endian(std::uint32_t value) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<char>(value >> shift & 0xffU));
    return bytes;
}

std::string chunk(const std::string& name, const std::string& content) {
    std::uint32_t sum = 0xffffffffU;
    for (const char c : name + content) {
        sum ^= static_cast<unsigned char>(c);
        for (int bit = 0; bit < 8; ++bit) sum = (sum & 1U) != 0 ? sum >> 1 ^ 0xedb88320U : sum >> 1;
    }
    return big_endian(static_cast<std::uint32_t>(content.size())) + name + content + big_endian(~sum);
}

/// zlib's format without compression.
std::string stored(const std::string& bytes) {
    std::uint32_t a = 1, b = 0;
    for (const char c : bytes) {
        a = (a + static_cast<unsigned char>(c)) % 65521;
        b = (b + a) % 65521;
    }
    const auto size = static_cast<std::uint32_t>(bytes.size());
    std::string block = "\x78\x01\x01";
    for (const std::uint32_t word : {size, ~size}) {
        block.push_back(static_cast<char>(word & 0xffU));
        block.push_back(static_cast<char>(word >> 8 & 0xffU));
    }
    return block + bytes + big_endian(b << 16 | a);
}

struct Pass {
    int x, y, right, down;
};

/// Rows as PNG stores them: filter 0, values of `depth` bits.
std::string rows_of(const ControlField& field, int depth, bool interlaced) {
    std::vector<Pass> passes{{0, 0, 1, 1}};
    if (interlaced)
        passes = {{0, 0, 8, 8}, {4, 0, 8, 8}, {0, 4, 4, 8}, {2, 0, 4, 4},
                  {0, 2, 2, 4}, {1, 0, 2, 2}, {0, 1, 1, 2}};
    std::string rows;
    for (const Pass& pass : passes) {
        if (pass.x >= field.size.width) continue;
        for (int y = pass.y; y < field.size.height; y += pass.down) {
            rows.push_back('\0');
            int bits = 0;
            for (int x = pass.x; x < field.size.width; x += pass.right, bits += depth) {
                if (bits % 8 == 0) rows.push_back('\0');
                const int value = field.labels[static_cast<std::size_t>(y * field.size.width + x)];
                rows.back() = static_cast<char>(rows.back() | value << (8 - depth - bits % 8));
            }
        }
    }
    return rows;
}

enum Colour { grey_png = 0, palette_png = 3 };

std::string header(Size size, int depth, int colour, bool interlaced = false) {
    return chunk("IHDR", big_endian(static_cast<std::uint32_t>(size.width)) +
                             big_endian(static_cast<std::uint32_t>(size.height)) +
                             std::string{static_cast<char>(depth), static_cast<char>(colour), 0, 0,
                                         static_cast<char>(interlaced)});
}

const std::string signature = "\x89PNG\r\n\x1a\n";
const std::string end = chunk("IEND", "");

/// Entries of a palette, of other colours than palette_of().
std::string plte(int colours) {
    std::string bytes;
    for (int i = 0; i < 3 * colours; ++i) bytes.push_back(static_cast<char>(200 - i));
    return chunk("PLTE", bytes);
}

std::string png_of(const ControlField& field, int depth, Colour colour, bool interlaced = false,
                   const std::string& before_pixels = {}) {
    return signature + header(field.size, depth, colour, interlaced) +
           (colour == palette_png ? plte(std::min(1 << depth, field.regions)) : "") + before_pixels +
           chunk("IDAT", stored(rows_of(field, depth, interlaced))) + end;
}

// --- Errors
// -------------------------------------------------------------------------------------------------------

/// The one line that a user sees; nothing else may be printed.
std::string failure(auto&& action) {
    testing::internal::CaptureStderr();
    std::string message = "no error";
    try {
        action();
    } catch (const InputError& error) {
        message = error.what();
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    return message;
}

std::string read_failure(const fs::path& path, const Palette& palette) {
    return failure([&] { static_cast<void>(read_labels(path, palette)); });
}

std::string read_failure(const TemporaryFolder& folder, const std::string& bytes, int regions) {
    put_bytes(folder / "a.png", bytes);
    return read_failure(folder / "a.png", palette_of(regions));
}

testing::AssertionResult says(const std::string& message, const std::string& part) {
    if (message.find(part) != std::string::npos) return testing::AssertionSuccess();
    return testing::AssertionFailure() << '"' << message << "\" does not say \"" << part << '"';
}

TEST(LabelPicture, ComesBack) {
    const TemporaryFolder folder;
    for (const Size size : {Size{1, 1}, Size{1, 7}, Size{31, 17}, Size{64, 300}}) {
        for (const int regions : {1, 2, 3, 17, 32}) {
            const ControlField field = field_of(size, regions);
            write_labels(folder / "a.png", field, palette_of(regions));
            expect_same(read_labels(folder / "a.png", palette_of(regions)), field,
                        std::to_string(size.width) + " wide, K " + std::to_string(regions));
        }
    }
}

TEST(LabelPicture, IsAPngWithThePaletteAndNoMore) {
    const TemporaryFolder folder;
    const ControlField field = field_of({5, 9}, 4);
    write_labels(folder / "a.png", field, palette_of(6));  // of which the first four are needed
    const std::string bytes = bytes_of(folder / "a.png");
    std::string entries;
    for (const PaletteColour& colour : palette_of(4)) entries.append(colour.begin(), colour.end());
    const std::string before = signature + header(field.size, 8, palette_png) + chunk("PLTE", entries);
    EXPECT_EQ(bytes.substr(0, before.size()), before);
    EXPECT_EQ(bytes.substr(before.size() + 4, 4), "IDAT");
    const std::size_t length = bytes.size() - before.size() - end.size() - 12;
    EXPECT_EQ(bytes.substr(before.size(), 4), big_endian(static_cast<std::uint32_t>(length)));
    EXPECT_EQ(bytes.substr(bytes.size() - end.size()), end);

    const Image image = read_picture(folder / "a.png").image;
    const Image wanted = painted(field, palette_of(4));
    EXPECT_TRUE(std::equal(image.values().begin(), image.values().end(), wanted.values().begin(),
                           wanted.values().end()));
    write_labels(folder / "B.PNG", field, palette_of(4));
    EXPECT_EQ(bytes_of(folder / "B.PNG"), bytes);
    EXPECT_EQ(folder.names(), (std::vector<std::string>{"B.PNG", "a.png"}));
}

TEST(LabelPicture, ValuesOfAnyDepthAreLabels) {
    const TemporaryFolder folder;
    for (const Colour colour : {grey_png, palette_png}) {
        for (const int depth : {1, 2, 4, 8}) {
            for (const bool interlaced : {false, true}) {
                for (const Size size : {Size{1, 1}, Size{3, 2}, Size{13, 11}}) {
                    const ControlField field = field_of(size, std::min(1 << depth, most_regions));
                    put_bytes(folder / "a.png", png_of(field, depth, colour, interlaced));
                    expect_same(read_labels(folder / "a.png", palette_of(field.regions)), field,
                                std::to_string(depth) + " bits, colour type " + std::to_string(colour) +
                                    (interlaced ? ", interlaced" : ""));
                }
            }
        }
    }
}

TEST(LabelPicture, APaletteOfOtherLengthDoesNotMatter) {
    const TemporaryFolder folder;
    const ControlField field = field_of({6, 7}, 3);
    put_bytes(folder / "a.png", signature + header(field.size, 8, palette_png) + plte(256) +
                                    chunk("IDAT", stored(rows_of(field, 8, false))) + end);
    ControlField wanted = field;
    for (const int regions : {3, 20}) {
        wanted.regions = regions;
        expect_same(read_labels(folder / "a.png", palette_of(regions)), wanted, std::to_string(regions));
    }
}

TEST(LabelPicture, GreyOfEveryFormatIsReadByValue) {
    const TemporaryFolder folder;
    const ControlField field = field_of({12, 9}, 32);
    for (const char* name : {"a.png", "a.tif", "a.pgm"}) {
        write_picture(folder / name, grey(field));
        expect_same(read_labels(folder / name, palette_of(32)), field, name);
    }
    const ControlField labels{{2, 3}, 7, {0, 1, 2, 6, 5, 4}};
    for (const char* maximum : {"6", "31", "200", "255"}) {  // of which a reader scales all but the last
        put_bytes(folder / "b.pgm", "P2 3 2 " + std::string(maximum) + " 0 1 2 6 5 4\n");
        expect_same(read_labels(folder / "b.pgm", palette_of(7)), labels, maximum);
    }
}

TEST(LabelPicture, ColoursOfEveryFormatAreLookedUp) {
    const TemporaryFolder folder;
    const ControlField field = field_of({12, 9}, 32);
    for (const char* name : {"a.png", "a.tif", "a.ppm"}) {
        write_picture(folder / name, painted(field, palette_of(32)));
        expect_same(read_labels(folder / name, palette_of(32)), field, name);
    }
    // A photographic format keeps a plain colour.
    const ControlField plain{{8, 8}, 2, Labels(64, 1)};
    write_picture(folder / "a.jpg", painted(plain, {{0, 0, 0}, {255, 255, 255}}));
    expect_same(read_labels(folder / "a.jpg", Palette{{0, 0, 0}, {255, 255, 255}}), plain, "a.jpg");
}

TEST(LabelPicture, OfTwoEqualColoursTheFirstIsMeant) {
    const TemporaryFolder folder;
    const Palette palette{{9, 9, 9}, {1, 2, 3}, {1, 2, 3}};
    const ControlField field{{1, 3}, 3, {2, 0, 1}};
    write_picture(folder / "a.ppm", painted(field, palette));
    EXPECT_EQ(read_labels(folder / "a.ppm", palette).labels, (Labels{1, 0, 1}));
    write_labels(folder / "a.png", field, palette);  // where colours do not count
    EXPECT_EQ(read_labels(folder / "a.png", palette).labels, field.labels);
}

TEST(LabelPicture, AlphaMustBeOpaque) {
    const TemporaryFolder folder;
    const Palette palette = palette_of(3);
    const std::string refused = "the pixel at column 1, row 1 is transparent";
    for (const std::uint8_t alpha : Labels{255, 254}) {
        Labels two, four;
        for (int i = 0; i < 6; ++i) {
            const std::uint8_t last = i == 4 ? alpha : std::uint8_t{255};  // column 1, row 1
            two.insert(two.end(), {2, last});
            four.insert(four.end(), {palette[2][0], palette[2][1], palette[2][2], last});
        }
        OIIO::ImageSpec spec(3, 2, 2, OIIO::TypeDesc::UINT8);
        spec.alpha_channel = 1;
        spec.attribute("oiio:UnassociatedAlpha", 1);
        test::write_foreign(folder / "two.png", spec, two);
        spec = OIIO::ImageSpec(3, 2, 4, OIIO::TypeDesc::UINT8);
        spec.attribute("oiio:UnassociatedAlpha", 1);
        test::write_foreign(folder / "four.png", spec, four);
        for (const char* name : {"two.png", "four.png"}) {
            if (alpha == 255) {
                expect_same(read_labels(folder / name, palette), {{2, 3}, 3, Labels(6, 2)}, name);
            } else {
                EXPECT_TRUE(says(read_failure(folder / name, palette), refused)) << name;
            }
        }
    }
    // Painting programs give a deleted part an entry of its own, and may move the others.
    const ControlField field{{2, 3}, 3, {1, 1, 2, 2, 0, 1}};
    const std::string clear = chunk("tRNS", std::string(1, '\x7f'));
    EXPECT_TRUE(says(read_failure(folder, png_of(field, 2, palette_png, false, clear), 3), refused));
    const std::string zero = chunk("tRNS", std::string(2, '\0'));
    EXPECT_TRUE(says(read_failure(folder, png_of(field, 2, grey_png, false, zero), 3), refused));
    const std::string unused = chunk("tRNS", std::string{'\0', '\3'});
    put_bytes(folder / "a.png", png_of(field, 2, grey_png, false, unused));
    expect_same(read_labels(folder / "a.png", palette), field, "an unused transparent value");
}

TEST(LabelPicture, AValueBeyondTheRegionsIsNamed) {
    const TemporaryFolder folder;
    const ControlField field{{2, 3}, 8, {0, 1, 2, 3, 7, 1}};
    const std::string found = ": the value at column 1, row 1 is 7; use the values 0 to 4";
    const std::string quoted = "read '" + (folder / "a.png").string() + "'";
    for (const Colour colour : {palette_png, grey_png}) {
        for (const int depth : {4, 8})
            EXPECT_EQ(read_failure(folder, png_of(field, depth, colour), 5), quoted + found);
    }
    write_picture(folder / "a.tif", grey(field));
    EXPECT_TRUE(says(read_failure(folder / "a.tif", palette_of(5)), found));
    put_bytes(folder / "a.pgm", "P2 3 2 9 0 1 2 3 7 1\n");
    EXPECT_TRUE(says(read_failure(folder / "a.pgm", palette_of(5)), found));
    EXPECT_TRUE(says(read_failure(folder / "a.pgm", palette_of(1)),
                     "the value at column 1, row 0 is 1; use the value 0 alone"));
}

TEST(LabelPicture, AValueBeyondTheFilesOwnPaletteIsDamage) {
    const TemporaryFolder folder;
    const ControlField field{{2, 3}, 8, {0, 1, 2, 3, 7, 1}};
    const std::string bytes = signature + header(field.size, 8, palette_png) + plte(4) +
                              chunk("IDAT", stored(rows_of(field, 8, false))) + end;
    EXPECT_TRUE(
        says(read_failure(folder, bytes, 8),
             "the value at column 1, row 1 is 7, beyond the 4 colours of its own palette; give a complete"));
}

TEST(LabelPicture, AnUnknownColourIsNamedWithTheNearest) {
    const TemporaryFolder folder;
    const ControlField field{{2, 3}, 4, {0, 1, 2, 2, 1, 3}};
    write_picture(folder / "a.png", painted(field, {{0, 0, 0}, {250, 0, 0}, {0, 250, 0}, {9, 200, 30}}));
    const Palette palette{{0, 0, 0}, {250, 0, 0}, {0, 250, 0}};
    EXPECT_EQ(read_failure(folder / "a.png", palette),
              "read '" + (folder / "a.png").string() +
                  "': the colour at column 2, row 1, 9,200,30, is not in the palette; paint with the "
                  "palette's colours, which are others once regions were edited, and hard edges; the nearest "
                  "is 0,250,0, of region 2");
}

TEST(LabelPicture, RefusesWhatHoldsNoLabels) {
    const TemporaryFolder folder;
    const Palette palette = palette_of(3);
    const Image image = painted(field_of({4, 4}, 3), palette);
    write_picture(folder / "a.png", image, PixelType::uint16);
    EXPECT_TRUE(says(read_failure(folder / "a.png", palette),
                     "it has 3 planes of type uint16; give a picture of 8 bits"));
    write_picture(folder / "a.png", grey(field_of({4, 4}, 3)), PixelType::uint16);
    EXPECT_TRUE(says(read_failure(folder / "a.png", palette), "it has 1 plane of type uint16"));
    write_picture(folder / "a.exr", image);
    EXPECT_TRUE(says(read_failure(folder / "a.exr", palette), "it has 3 planes of type half"));
    write_picture(folder / "five.tif", Image({4, 4}, 5));
    EXPECT_TRUE(says(read_failure(folder / "five.tif", palette), "it has 5 planes of type uint8"));
    EXPECT_TRUE(says(read_failure(folder / "none.png", palette), "there is no such file; check the name"));
    EXPECT_TRUE(says(read_failure(folder.path(), palette), "it is a folder"));
    EXPECT_TRUE(says(read_failure(folder / "a.exr", {}), "the palette has 0 colours; give 1 to 32"));
    EXPECT_TRUE(says(read_failure(folder / "a.exr", palette_of(33)), "the palette has 33 colours"));
}

TEST(LabelPicture, AnyDamageIsOneCleanError) {
    const TemporaryFolder folder;
    const ControlField field = field_of({4, 5}, 4);
    write_labels(folder / "whole.png", field, palette_of(4));
    const std::string whole = bytes_of(folder / "whole.png");
    for (const std::string& bytes :
         {whole, png_of(field, 2, palette_png, true), png_of(field, 4, grey_png)}) {
        ASSERT_EQ(read_failure(folder, bytes, 4), "no error");
        for (std::size_t i = 0; i < bytes.size(); ++i) {
            EXPECT_NE(read_failure(folder, bytes.substr(0, i), 4), "no error") << "cut at " << i;
            std::string damaged = bytes;
            damaged[i] = static_cast<char>(damaged[i] ^ 1);
            EXPECT_NE(read_failure(folder, damaged, 4), "no error") << "bit at " << i;
        }
    }
}

TEST(LabelPicture, DamageUnderGoodChecksumsIsFoundByTheDecoder) {
    const TemporaryFolder folder;
    const ControlField field = field_of({4, 5}, 4);
    const std::string start = signature + header(field.size, 8, palette_png);
    const std::string rows = rows_of(field, 8, false);
    const std::string pixels = stored(rows);
    const auto message = [&](const std::string& chunks) { return read_failure(folder, start + chunks, 4); };
    ASSERT_EQ(message(plte(4) + chunk("IDAT", pixels) + end), "no error");
    const std::string refused = "it cannot be decoded (";
    std::string wrong_sum = pixels;
    wrong_sum.back() = static_cast<char>(wrong_sum.back() ^ 1);
    std::string wrong_filter = rows;
    wrong_filter.front() = 9;
    const std::vector<std::pair<const char*, std::string>> cases{
        {"no palette", chunk("IDAT", pixels) + end},
        {"an empty palette", plte(0) + chunk("IDAT", pixels) + end},
        {"two and a half colours", chunk("PLTE", "1234567") + chunk("IDAT", pixels) + end},
        {"two palettes", plte(4) + plte(4) + chunk("IDAT", pixels) + end},
        {"no pixels", plte(4) + end},
        {"empty pixels", plte(4) + chunk("IDAT", "") + end},
        {"too few rows", plte(4) + chunk("IDAT", stored(rows.substr(6))) + end},
        {"half a stream", plte(4) + chunk("IDAT", pixels.substr(0, pixels.size() / 2)) + end},
        {"a wrong sum", plte(4) + chunk("IDAT", wrong_sum) + end},
        {"no stream", plte(4) + chunk("IDAT", rows) + end},
        {"a filter that there is not", plte(4) + chunk("IDAT", stored(wrong_filter)) + end},
    };
    for (const auto& [what, chunks] : cases) EXPECT_TRUE(says(message(chunks), refused)) << what;
}

TEST(LabelPicture, ImpossibleSizesAreRefusedBeforeMemoryIsTaken) {
    const TemporaryFolder folder;
    const auto message = [&](Size size, int depth) {
        return read_failure(
            folder,
            signature + header(size, depth, palette_png) + plte(2) + chunk("IDAT", stored("1234")) + end, 2);
    };
    EXPECT_TRUE(says(message({1000000, 1000000}, 8), "its header says 1000000x1000000 pixels, which"));
    EXPECT_TRUE(says(message({1000000, 1000000}, 1), "its header says 1000000x1000000 pixels, which"));
    EXPECT_TRUE(says(message({1, 1000001}, 8), "its header says 1000001x1 pixels; give"));
    EXPECT_TRUE(says(message({0, 5}, 8), "its header says 5x0 pixels; give"));
    EXPECT_TRUE(says(message({-1, -1}, 8), "its header says 4294967295x4294967295 pixels; give"));
}

TEST(LabelPicture, ARequestThatCannotBeMetLeavesNoFile) {
    const TemporaryFolder folder;
    const ControlField field = field_of({4, 5}, 4);
    const auto message = [&](const fs::path& path, const ControlField& written, const Palette& palette) {
        return failure([&] { write_labels(path, written, palette); });
    };
    const Palette palette = palette_of(4);
    EXPECT_EQ(message(folder / "a.png", field, palette_of(3)),
              "write '" + (folder / "a.png").string() +
                  "': 3 colours are given for 4 regions; give a colour for each region");
    EXPECT_TRUE(says(message(folder / "a.tif", field, palette),
                     "labels cannot be stored as '.tif'; end the name in .png"));
    EXPECT_TRUE(
        says(message(folder / "a", field, palette), "the name has no extension; end the name in .png"));
    EXPECT_TRUE(says(message(folder / "no/a.png", field, palette), "write '"));
    ControlField wrong = field;
    wrong.labels[7] = 4;
    EXPECT_NE(message(folder / "a.png", wrong, palette), "no error");
    const ControlField wide{{1, 1000001}, 1, Labels(1000001)};
    EXPECT_TRUE(says(message(folder / "a.png", wide, palette),
                     "1000001x1 pixels are too many for a PNG; use at most 1000000 on a side"));
    EXPECT_TRUE(folder.names().empty());
}

}  // namespace
}  // namespace btfield
