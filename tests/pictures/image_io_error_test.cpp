// Bad files, impossible requests, full disks: what image_io refuses, and that it says why.

#include <OpenImageIO/deepdata.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "tests/full_disk.hpp"
#include "tests/picture_files.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using namespace std::string_literals;
using test::bytes_of;
using test::put_bytes;
using test::sampled;
using test::TemporaryFolder;
using test::write_foreign;
using Names = std::vector<std::string>;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();
const std::vector<std::string> extensions{".png", ".jpg", ".tif", ".exr", ".hdr", ".ppm"};

/// The one line that a user sees; nothing else may be printed.
std::string failure(auto&& action) {
    testing::internal::CaptureStderr();
    testing::internal::CaptureStdout();
    std::string message = "no error";
    try {
        action();
    } catch (const InputError& error) {
        message = error.what();
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
    EXPECT_EQ(message.find('\n'), std::string::npos);
    return message;
}

std::string read_failure(const fs::path& path, std::optional<Crop> crop = {}) {
    return failure([&] { static_cast<void>(read_picture(path, crop)); });
}

testing::AssertionResult says(const std::string& message, std::string_view part) {
    if (message.find(part) != std::string::npos) return testing::AssertionSuccess();
    return testing::AssertionFailure() << '"' << message << "\" does not say \"" << part << '"';
}

/// Rows of noise below a ramp: every codec keeps something of every row.
Image busy(Size size, int planes, ColourSpace space) {
    Image image = sampled(size, planes, space, PixelType::uint8);
    for (int r = 0; r < size.height; ++r) {
        for (int p = 0; p < planes; ++p)
            image.at(p, r, 0) = static_cast<float>(r) / static_cast<float>(size.height);
    }
    return image;
}

// --- Reading
// -------------------------------------------------------------------------------------------------------

TEST(image_io_error, what_is_no_picture) {
    const TemporaryFolder folder;
    const std::string quoted = "read '" + (folder / "a.png").string() + "': ";
    EXPECT_EQ(read_failure(folder / "a.png"), quoted + "there is no such file; check the name");
    EXPECT_TRUE(says(read_failure(folder / "no/such/folder/a.png"), "there is no such file"));

    put_bytes(folder / "a.png", "");
    EXPECT_EQ(read_failure(folder / "a.png"),
              quoted + "the file is empty; give a complete and undamaged file");

    for (const auto& text : {"This is no picture.\n"s, "x"s, "P5"s, "P5x"s, "P7\n1 1\n"s,
                             "GIF89a..............."s, std::string(100, '\0'), "\x89PNG\r\n"s}) {
        put_bytes(folder / "a.png", text);
        EXPECT_EQ(
            read_failure(folder / "a.png"),
            quoted +
                "it is not a picture of a known format; give a PNG, JPEG, TIFF, EXR, HDR, PNM, WebP or HEIC "
                "picture");
    }
    EXPECT_EQ(read_failure(folder.path()),
              "read '" + folder.path().string() +
                  "': it is a folder; give a PNG, JPEG, TIFF, EXR, HDR, PNM, WebP or HEIC picture");
    EXPECT_TRUE(
        says(read_failure("/dev/null"), "it is a device or a pipe; store the picture in a file first"));
    EXPECT_TRUE(says(read_failure(folder / "a.png/b.png"), "read '"));
}

TEST(image_io_error, content_decides_not_the_name) {
    const TemporaryFolder folder;
    const Image image = busy({9, 12}, 3, ColourSpace::srgb);
    write_picture(folder / "a.png", image);
    fs::rename(folder / "a.png", folder / "a.jpg");
    EXPECT_EQ(read_picture(folder / "a.jpg").image.size(), (Size{9, 12}));
}

TEST(image_io_error, truncated_files) {
    const TemporaryFolder folder;
    const Image image = busy({90, 64}, 3, ColourSpace::srgb);
    for (const std::string& extension : extensions) {
        const fs::path path = folder / ("a" + extension);
        write_picture(path, image);
        ASSERT_NO_THROW(static_cast<void>(read_picture(path)));
        const std::string whole = bytes_of(path);
        // Many cuts, and all of the last bytes.
        std::vector<std::size_t> cuts;
        for (std::size_t i = 1; i < 60; ++i) cuts.push_back(whole.size() * i / 60);
        for (std::size_t i = 1; i < 20; ++i) cuts.push_back(whole.size() - i);
        for (std::size_t i = 1; i < 40; ++i) cuts.push_back(i);
        for (const std::size_t cut : cuts) {
            put_bytes(path, std::string_view(whole).substr(0, cut));
            EXPECT_TRUE(says(read_failure(path), "read '"))
                << extension << " of " << whole.size() << " cut at " << cut;
        }
    }
}

TEST(image_io_error, truncated_files_say_so) {
    const TemporaryFolder folder;
    const Image image = busy({90, 64}, 3, ColourSpace::srgb);
    for (const std::string extension : {".png", ".jpg", ".ppm"}) {
        const fs::path path = folder / ("a" + extension);
        write_picture(path, image);
        const std::string whole = bytes_of(path);
        put_bytes(path, std::string_view(whole).substr(0, whole.size() * 2 / 3));
        const std::string message = read_failure(path);
        EXPECT_TRUE(says(message, "it ends inside its pixel data"));
        EXPECT_TRUE(says(message, "; give a complete and undamaged file"));
    }
}

TEST(image_io_error, a_jpeg_that_was_closed_again_after_a_cut) {
    const TemporaryFolder folder;
    write_picture(folder / "a.jpg", busy({90, 64}, 3, ColourSpace::srgb));
    const std::string whole = bytes_of(folder / "a.jpg");
    put_bytes(folder / "a.jpg", whole.substr(0, whole.size() / 2) + "\xff\xd9");
    EXPECT_TRUE(says(read_failure(folder / "a.jpg"), "premature end"));
}

TEST(image_io_error, damaged_files_give_an_error_or_numbers) {
    const TemporaryFolder folder;
    const Image image = busy({40, 32}, 3, ColourSpace::srgb);
    unsigned state = 1;
    const auto random = [&](std::size_t n) {
        state = state * 1664525U + 1013904223U;  // a linear congruence is enough to spread the damage
        return static_cast<std::size_t>(state >> 8) % n;
    };
    for (const std::string& extension : extensions) {
        const fs::path path = folder / ("a" + extension);
        write_picture(path, image);
        const std::string whole = bytes_of(path);
        int refused = 0;
        for (int i = 0; i < 150; ++i) {
            std::string bytes = whole;
            // Half of the damage in the first bytes, where the header is.
            const std::size_t reach = i % 2 == 0 ? std::min<std::size_t>(bytes.size(), 200) : bytes.size();
            for (int k = 0; k <= i % 5; ++k) bytes[random(reach)] = static_cast<char>(random(256));
            put_bytes(path, bytes);
            testing::internal::CaptureStderr();
            try {
                const Picture read = read_picture(path);
                EXPECT_TRUE(std::all_of(read.image.values().begin(), read.image.values().end(),
                                        [](float v) { return std::isfinite(v); }));
            } catch (const InputError&) {
                ++refused;
            }
            EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << extension << ' ' << i;
        }
        EXPECT_GT(refused, 0) << extension;
    }
}

TEST(image_io_error, not_a_number) {
    const TemporaryFolder folder;
    OIIO::ImageSpec spec(4, 3, 3, OIIO::TypeDesc::FLOAT);
    std::vector<float> values(36, 0.5F);
    values[(1 * 4 + 2) * 3 + 1] = nan;
    write_foreign(folder / "a.exr", spec, values);
    EXPECT_EQ(read_failure(folder / "a.exr"),
              "read '" + (folder / "a.exr").string() +
                  "': plane 1 is NaN at column 2, row 1; repair those pixels or crop "
                  "them away");
    values[(1 * 4 + 2) * 3 + 1] = -infinity;
    write_foreign(folder / "a.tif", spec, values);
    EXPECT_TRUE(says(read_failure(folder / "a.tif"), "plane 1 is infinite at column 2, row 1"));
    spec.format = OIIO::TypeDesc::HALF;
    write_foreign(folder / "b.exr", spec, values);
    EXPECT_TRUE(says(read_failure(folder / "b.exr"), "plane 1 is infinite at column 2, row 1"));

    // Outside the crop it does no harm; inside, it is named where the user finds it.
    EXPECT_NO_THROW(static_cast<void>(read_picture(folder / "a.exr", Crop{0, 0, 2, 3})));
    EXPECT_TRUE(says(read_failure(folder / "a.exr", Crop{1, 1, 3, 2}), "plane 1 is NaN at column 2, row 1"));
}

TEST(image_io_error, crops) {
    const fs::path path = fs::path(test::data_folder()) / "cork-xyz.exr";
    constexpr int most = std::numeric_limits<int>::max();
    for (const Crop crop : {Crop{0, 0, 0, 5}, Crop{0, 0, 5, 0}, Crop{-1, 0, 5, 5}, Crop{0, -1, 5, 5},
                            Crop{0, 0, -5, 5}, Crop{124, 0, 5, 5}, Crop{0, 124, 5, 5}, Crop{128, 0, 1, 1},
                            Crop{1, 1, most, most}, Crop{most, most, most, most}}) {
        EXPECT_TRUE(says(read_failure(path, crop), "is empty or leaves the picture of 128x128 pixels"));
    }
    EXPECT_EQ(
        read_failure(path, Crop{124, 0, 5, 6}),
        "read '" + path.string() +
            "': the crop 124,0,5,6 is empty or leaves the picture of 128x128 pixels; give X,Y,W,H inside the "
            "picture");
    EXPECT_TRUE(
        says(read_failure(fs::path(test::data_folder()) / "rock.png", Crop{0, 0, 257, 1}), "256x256"));
}

TEST(image_io_error, sizes_that_cannot_be) {
    const TemporaryFolder folder;
    const auto png = [](unsigned width, unsigned height) {
        // A header, no pixels, an end; the decoder checks the sums of header and end first.
        std::string bytes = "\x89PNG\r\n\x1a\n"s;
        const auto chunk = [&](const std::string& name, const std::string& content) {
            const auto word = [&](unsigned v) {
                for (int shift = 24; shift >= 0; shift -= 8)
                    bytes.push_back(static_cast<char>(v >> shift & 0xff));
            };
            word(static_cast<unsigned>(content.size()));
            bytes += name + content;
            unsigned sum = 0xffffffffU;
            for (const char c : name + content) {
                sum ^= static_cast<unsigned char>(c);
                for (int k = 0; k < 8; ++k) sum = (sum & 1U) != 0 ? sum >> 1 ^ 0xedb88320U : sum >> 1;
            }
            word(~sum);
        };
        std::string header;
        for (const unsigned v : {width, height}) {
            for (int shift = 24; shift >= 0; shift -= 8)
                header.push_back(static_cast<char>(v >> shift & 0xff));
        }
        chunk("IHDR", header + "\x08\x02\0\0\0"s);
        chunk("IDAT", "\x78\x9c\x03\0\0\0\0\x01"s);
        chunk("IEND", "");
        return bytes;
    };
    put_bytes(folder / "a.png", png(900000, 900000));
    EXPECT_TRUE(says(read_failure(folder / "a.png"),
                     "its header says 900000x900000 pixels, which 65 bytes cannot hold"));
    // Deflate makes at most 67080 bytes of 65.
    put_bytes(folder / "a.png", png(366, 366));
    EXPECT_TRUE(
        says(read_failure(folder / "a.png"), "its header says 366x366 pixels, which 65 bytes cannot hold"));
    put_bytes(folder / "a.png", png(0x7fffffff, 0x7fffffff));
    EXPECT_TRUE(says(read_failure(folder / "a.png"), "its header says 2147483647x2147483647 pixels"));
    put_bytes(folder / "a.png", png(0, 5));
    EXPECT_TRUE(says(read_failure(folder / "a.png"), "its header says 0x5 pixels"));

    // The decoder would take the memory first.
    put_bytes(folder / "a.exr",
              "\x76\x2f\x31\x01\2\0\0\0owner\0string\0\1\0\0\0xmore\0string\0\xff\xff\xff\x7f??"s);
    EXPECT_TRUE(says(read_failure(folder / "a.exr"),
                     "its header's 'more' claims 2147483647 bytes, where 2 are left"));
    // Behind the header there are offsets and pixels, which may look like anything.
    const std::string pixels = "\0x\0y\0\xff\xff\xff\x7f"s;
    put_bytes(folder / "a.exr", "\x76\x2f\x31\x01\2\0\0\0owner\0string\0\1\0\0\0x"s + pixels);
    EXPECT_FALSE(says(read_failure(folder / "a.exr"), "claims"));
    put_bytes(folder / "a.exr", "\x76\x2f\x31\x01\2\x10\0\0owner\0string\0\1\0\0\0x"s + pixels);
    EXPECT_TRUE(
        says(read_failure(folder / "a.exr"), "its header's 'x' claims 2147483647 bytes, where 0 are left"));

    put_bytes(folder / "a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2000000000 +X 2000000000\n");
    EXPECT_TRUE(says(read_failure(folder / "a.hdr"), "cannot hold"));
}

TEST(image_io_error, pnm) {
    const TemporaryFolder folder;
    const auto message = [&](const std::string& bytes) {
        put_bytes(folder / "a.pnm", bytes);
        return read_failure(folder / "a.pnm");
    };
    EXPECT_TRUE(
        says(message("P5\n3 2\n255\n12345"), "it ends inside its pixel data: 5 bytes for 3x2 pixels"));
    EXPECT_TRUE(says(message("P5\n2000000000 2000000000\n255\n12345"), "it ends inside its pixel data"));
    EXPECT_TRUE(says(message("P2\n2 2\n255\n1 2 3"), "it ends inside its pixel data"));
    EXPECT_TRUE(says(message("P2\n2 1\n255\n1 x"), "its pixel data is not a number"));
    EXPECT_TRUE(says(message("P2\n2 1\n255\n1 -3"), "its pixel data is not a number"));
    EXPECT_TRUE(says(message("P2\n2 1\n9\n1 10"), "a value is 10, above its maximum of 9"));
    EXPECT_TRUE(says(message("P5\n2 1\n9\n\x01\x0a"), "a value is 10, above its maximum of 9"));
    EXPECT_TRUE(says(message("P5\n0 1\n255\nx"), "there are no pixels"));
    EXPECT_TRUE(says(message("P5\n-4 1\n255\nx"), "its width is not a number"));
    EXPECT_TRUE(says(message("P5\n99999999999 1\n255\nx"), "its width is not a number"));
    EXPECT_TRUE(says(message("P5\n1 1\n0\nx"), "its maximum is 0"));
    EXPECT_TRUE(says(message("P5\n1 1\n65536\nxx"), "its maximum is 65536"));
    EXPECT_TRUE(says(message("P5\n# only a comment"), "it ends inside its width"));
    EXPECT_TRUE(says(message("P5\n1 1\n255"), "it ends inside its pixel data"));
}

TEST(image_io_error, kinds_that_are_not_flat_pictures) {
    const TemporaryFolder folder;
    const OIIO::ImageSpec real(3, 1, 1, OIIO::TypeDesc::DOUBLE);
    write_foreign(folder / "a.tif", real, std::vector<double>{-2.5, 0.1, 1e6});
    EXPECT_TRUE(says(read_failure(folder / "a.tif"), "64-bit values; convert it to 32-bit float"));

    OIIO::ImageSpec deep(2, 1, 1, OIIO::TypeDesc::FLOAT);
    deep.deep = true;
    OIIO::DeepData samples(deep);
    samples.set_samples(0, 1);
    samples.set_samples(1, 2);
    const auto output = OIIO::ImageOutput::create((folder / "a.exr").string());
    ASSERT_TRUE(output && output->open((folder / "a.exr").string(), deep));
    ASSERT_TRUE(output->write_deep_image(samples) && output->close());
    EXPECT_TRUE(says(read_failure(folder / "a.exr"), "it is a deep picture; give a flat picture"));
}

// --- Writing
// -------------------------------------------------------------------------------------------------------

std::string write_failure(const fs::path& path, const Image& image, std::optional<PixelType> type = {}) {
    return failure([&] { write_picture(path, image, PixelType::uint8, type); });
}

std::string check_failure(const fs::path& path, int planes, std::optional<PixelType> type = {}) {
    return failure([&] { check_writable(path, planes, PixelType::uint8, type); });
}

TEST(image_io_error, writing_what_a_format_cannot_hold) {
    const TemporaryFolder folder;
    struct {
        const char* file;
        int planes;
        std::optional<PixelType> type;
        const char* message;
    } const cases[] = {
        {"a", 3, {}, "the name has no extension; end the name in .png"},
        {"a.xyz", 3, {}, "'.xyz' is not known; end the name in .png"},
        {"a.png", 2, {}, "the picture has 2 planes and .png holds 1 or 3; use .tif or .exr"},
        {"a.png", 4, {}, "the picture has 4 planes and .png holds 1 or 3"},
        {"a.jpg", 6, {}, "the picture has 6 planes and .jpg holds 1 or 3"},
        {"a.hdr", 1, {}, "the picture has 1 plane and .hdr holds 3;"},
        {"a.pgm", 3, {}, "the picture has 3 planes and .pgm holds 1;"},
        {"a.ppm", 1, {}, "the picture has 1 plane and .ppm holds 3;"},
        {"a.png", 3, PixelType::half,
         "PNG cannot hold half, only uint8, uint16; choose another type or extension"},
        {"a.png", 3, PixelType::float32, "PNG cannot hold float"},
        {"a.jpg", 3, PixelType::uint16, "JPEG cannot hold uint16, only uint8"},
        {"a.exr", 3, PixelType::uint8, "EXR cannot hold uint8, only half, float"},
        {"a.hdr", 3, PixelType::half, "HDR cannot hold half, only float"},
        {"a.ppm", 3, PixelType::float32, "PNM cannot hold float, only uint8, uint16"},
    };
    for (const auto& c : cases) {
        const std::string message = write_failure(folder / c.file, Image({4, 5}, c.planes), c.type);
        EXPECT_TRUE(says(message, "write '" + (folder / c.file).string() + "': " + c.message));
        EXPECT_EQ(check_failure(folder / c.file, c.planes, c.type), message);
    }
    EXPECT_TRUE(says(write_failure(folder / "a.png", Image()), "the picture has 0 planes"));
    EXPECT_TRUE(folder.names().empty());
}

TEST(image_io_error, writing_where_nothing_can_be) {
    const TemporaryFolder folder;
    const Image image({4, 5}, 3, ColourSpace::srgb);
    for (const fs::path& path : {folder / "no/a.png", fs::path("/proc/a.png")}) {
        const std::string message = write_failure(path, image);
        EXPECT_TRUE(says(message, "write '" + path.string() + "': "));
        EXPECT_EQ(check_failure(path, 3), message);
    }
    EXPECT_TRUE(says(write_failure(folder / "no/a.png", image),
                     "the folder '" + (folder / "no").string() + "' does not exist; make it"));
    fs::create_directory(folder / "b.png");
    EXPECT_TRUE(says(write_failure(folder / "b.png", image), "is a folder; give a file name"));
    EXPECT_EQ(check_failure(folder / "c.png", 3), "no error");
    EXPECT_EQ(folder.names(), Names{"b.png"});
}

TEST(image_io_error, values_that_are_no_numbers_are_not_written) {
    const TemporaryFolder folder;
    for (const std::string& extension : extensions) {
        const fs::path path = folder / ("a" + extension);
        put_bytes(path, "old");
        Image image({4, 5}, 3, ColourSpace::srgb);
        image.at(2, 1, 3) = nan;
        EXPECT_TRUE(says(write_failure(path, image), "plane 2 is NaN at column 3, row 1"));
        image.at(2, 1, 3) = infinity;
        EXPECT_TRUE(says(write_failure(path, image), "plane 2 is infinite at column 3, row 1"));
        EXPECT_EQ(bytes_of(path), "old");
    }
    EXPECT_EQ(folder.names().size(), extensions.size());
}

TEST(image_io_error, values_too_large_for_the_type_are_not_written) {
    const TemporaryFolder folder;
    Image image({1, 1}, 3, ColourSpace::linear);
    image.at(0, 0, 0) = 65519.0F;  // the last that rounds to the largest half, 65504
    EXPECT_EQ(write_failure(folder / "a.exr", image), "no error");
    EXPECT_EQ(read_picture(folder / "a.exr").image.at(0, 0, 0), 65504.0F);
    for (const float v : {65520.0F, -65520.0F}) {
        image.at(0, 0, 0) = v;
        EXPECT_TRUE(
            says(write_failure(folder / "b.exr", image), "too large for the file's type; write EXR or TIFF"));
    }
    EXPECT_EQ(write_failure(folder / "c.exr", image, PixelType::float32), "no error");
    image.at(0, 0, 0) = 3e38F;
    EXPECT_TRUE(says(write_failure(folder / "d.hdr", image), "too large for the file's type"));
    EXPECT_EQ(folder.names(), (Names{"a.exr", "c.exr"}));
}

TEST(image_io_error, a_full_disk_leaves_the_old_file) {
    const TemporaryFolder folder;
    const Image image = busy({300, 200}, 3, ColourSpace::srgb);
    for (const std::string& extension : extensions) {
        const fs::path path = folder / ("a" + extension);
        write_picture(path, image);
        const std::string old = bytes_of(path);
        // Right away, in the middle, and at the very last byte, which only closing the file writes.
        for (const std::size_t room : {std::size_t{0}, old.size() / 2, old.size() - 1}) {
            std::string message;
            {
                const test::FullDisk disk(room);
                message = write_failure(path, image);
            }
            EXPECT_TRUE(says(message, "write '" + path.string() + "': ")) << room;
            EXPECT_EQ(bytes_of(path), old) << extension;
            EXPECT_EQ(folder.names(), Names{path.filename()}) << extension;
        }
        fs::remove(path);
        {
            const test::FullDisk disk(old.size() / 2);
            EXPECT_TRUE(says(write_failure(path, image), "; free some space or choose another"));
        }
        EXPECT_TRUE(folder.names().empty()) << extension;
    }
}

TEST(image_io_error, a_device_as_output_stays_one) {
    const TemporaryFolder folder;
    const Image image = busy({20, 30}, 3, ColourSpace::srgb);
    fs::create_symlink("/dev/null", folder / "null.png");
    fs::create_symlink("/dev/full", folder / "full.png");
    EXPECT_EQ(write_failure(folder / "null.png", image), "no error");
    EXPECT_TRUE(says(write_failure(folder / "full.png", image), "No space left on device"));
    EXPECT_TRUE(fs::is_character_file("/dev/null"));
    EXPECT_TRUE(fs::is_character_file("/dev/full"));
    EXPECT_EQ(folder.names(), (Names{"full.png", "null.png"}));
}

}  // namespace
}  // namespace btfield
