// Every picture of tests/data, and of $BTFIELD_SWEEP_FOLDER where it is set, through fit and synth in each
// format and back: the texture looks the same, whatever the file, and keeps what its model says. For a folder
// of one's own it prints a table of how far every file is off.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iomanip>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "btfield/image_io.hpp"
#include "btfield/model_file.hpp"
#include "host/pictures/colour.hpp"
#include "tests/cli_cases.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using test::btfield;
using test::Surroundings;
using test::TemporaryFolder;

/// \param extension with its dot, in any case
bool is_picture(std::string extension) {
    static const std::set<std::string> extensions{".png", ".jpg", ".jpeg", ".tif",  ".tiff", ".exr", ".hdr",
                                                  ".pgm", ".ppm", ".pnm",  ".webp", ".heic", ".heif"};
    std::ranges::transform(extension, extension.begin(), [](char c) {
        return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    });
    return extensions.contains(extension);
}

bool is_constant(const Image& image) {
    for (int p = 0; p < image.planes(); ++p)
        if (std::ranges::adjacent_find(image.plane(p), std::not_equal_to<>()) != image.plane(p).end())
            return false;
    return true;
}

std::vector<fs::path> pictures() {
    std::vector<fs::path> result;
    std::vector<fs::path> folders{test::data_folder()};
    if (const char* more = std::getenv("BTFIELD_SWEEP_FOLDER"); more != nullptr) folders.emplace_back(more);
    for (const fs::path& folder : folders)
        for (const auto& entry : fs::directory_iterator(folder))
            if (is_picture(entry.path().extension().string())) result.push_back(entry.path());
    std::sort(result.begin(), result.end());
    return result;
}

/// One way to write a texture, and how far its light may be off: root mean square, of the largest value.
struct Way {
    std::string name;
    std::vector<std::string> options;
    double bound;
};

/// Rounding to n bits is off by 1 / (√12 · 2ⁿ) of full scale, 2.3 times that where the sRGB curve is
/// steepest. JPEG: as image_io.jpeg_is_close has it for smooth pictures, textures being none. Half keeps 11
/// bits, RGBE 8 of the largest.
const std::vector<Way> ways{{"t.png", {"--type", "uint8"}, 2.3 / 255.0 / 3.4},
                            {"t16.png", {"--type", "uint16"}, 2.3 / 65535.0},
                            {"t.jpg", {}, 0.03},
                            {"t.pnm", {"--type", "uint8"}, 2.3 / 255.0 / 3.4},
                            {"t.tif", {}, 2.3 / 255.0 / 3.4},
                            {"tf.tif", {"--type", "float"}, 1e-6},
                            {"t.exr", {}, 1.0 / 2048.0},
                            {"tf.exr", {"--type", "float"}, 1e-6},
                            {"t.hdr", {}, 1.0 / 128.0}};

/// Light of Rec. 709 where the values are colours, the values where they are not.
Image light_of(Image image) {
    if (image.space() != ColourSpace::unspecified)
        detail::convert(image, ColourSpace::linear);
    else
        detail::convert_planes(image, ColourSpace::linear);
    return image;
}

struct Statistics {
    double mean = 0.0, deviation = 0.0;
};

Statistics statistics(std::span<const float> values) {
    Statistics result;
    const auto count = static_cast<double>(values.size());
    for (const float v : values) result.mean += static_cast<double>(v) / count;
    for (const float v : values)
        result.deviation += std::pow(static_cast<double>(v) - result.mean, 2.0) / count;
    result.deviation = std::sqrt(result.deviation);
    return result;
}

class CliPicturesSweepLong : public testing::Test {
  protected:
    void sweep(const fs::path& path) {
        SCOPED_TRACE(path.string());
        const Picture whole = read_picture(path);
        if (is_constant(whole.image)) return;  // fit refuses
        const int width = std::min(128, whole.image.width()), height = std::min(128, whole.image.height());
        const std::string crop = "0,0," + std::to_string(width) + "," + std::to_string(height);
        const Image picture = whole.image.crop(0, 0, {height, width});
        ASSERT_EQ(btfield({"fit", path.string(), "-o", "m.btfm", "--crop", crop}, here_).code, 0);
        ASSERT_EQ(
            btfield({"synth", "m.btfm", "-o", "kept.exr", "--type", "float", "--keep-values"}, here_).code,
            0);
        const Picture kept = read_picture(folder_ / "kept.exr");
        const TextureModel model = read_model(folder_ / "m.btfm");
        EXPECT_EQ(kept.image.space(), model.space);
        EXPECT_EQ(kept.image.plane_spaces(), model.plane_spaces);
        if (picture.planes() > 1) {  // what grey is, its file's name decides
            EXPECT_EQ(model.space, whole.image.space());
            EXPECT_EQ(model.plane_spaces, whole.image.plane_spaces());
        }
        row_ = "| " + path.filename().string() + " |";
        for (int p = 0; p < picture.planes(); ++p) {
            const Statistics a = statistics(picture.plane(p)), b = statistics(kept.image.plane(p));
            // Marginals are the picture's; what is left is chance, on a texture of the picture's size.
            EXPECT_NEAR(b.mean, a.mean, 0.5 * a.deviation) << p;
            EXPECT_NEAR(b.deviation / a.deviation, 1.0, 0.4) << p;
        }
        for (const Way& way : ways) write(way, kept.image, whole.image.names());
        if (std::getenv("BTFIELD_SWEEP_FOLDER") != nullptr) std::cout << row_ << std::endl;
    }
    void write(const Way& way, const Image& kept, const std::vector<std::string>& names) {
        SCOPED_TRACE(way.name);
        const bool holds = kept.planes() == 3 || (kept.planes() == 1 && way.name != "t.hdr") ||
                           way.name.ends_with(".tif") || way.name.ends_with(".exr");
        if (!holds) {
            row_ += " |";
            return;
        }
        std::vector<std::string> words{"synth", "m.btfm", "-o", way.name};
        words.insert(words.end(), way.options.begin(), way.options.end());
        ASSERT_EQ(btfield(words, here_).code, 0);
        ++written_;
        Picture file = read_picture(folder_ / way.name);
        // JPEG and PNM cannot say that their grey is data.
        const bool data = kept.space() == ColourSpace::unspecified && kept.plane_spaces().empty();
        if (data && (way.name == "t.jpg" || way.name == "t.pnm")) file.image.set_plane_spaces({});
        const bool clamps = file.type == PixelType::uint8 || file.type == PixelType::uint16;
        Image expected = light_of(kept);
        if (clamps)
            for (float& v : expected.values()) v = std::clamp(v, 0.0F, 1.0F);
        if (way.name == "t.hdr")
            for (float& v : expected.values()) v = std::max(v, 0.0F);
        const Image found = light_of(file.image);
        ASSERT_EQ(found.size(), expected.size());
        ASSERT_EQ(found.planes(), expected.planes());
        double squares = 0.0, largest = 1.0;
        for (std::size_t i = 0; i < expected.values().size(); ++i) {
            squares += std::pow(
                static_cast<double>(found.values()[i]) - static_cast<double>(expected.values()[i]), 2.0);
            largest = std::max(largest, std::abs(static_cast<double>(expected.values()[i])));
        }
        const double off = std::sqrt(squares / static_cast<double>(expected.values().size())) / largest;
        EXPECT_LE(off, way.bound);
        std::ostringstream text;
        text << std::setprecision(2) << ' ' << off << " |";
        row_ += text.str();
        if (way.name.ends_with(".tif") || way.name.ends_with(".exr")) {
            EXPECT_EQ(file.image.names(), names);
        }
    }

    TemporaryFolder folder_;
    const Surroundings here_{.folder = folder_.path().string()};
    int written_ = 0;
    std::string row_;  ///< of the table
};

TEST_F(CliPicturesSweepLong, TexturesLookTheSameInEveryFormat) {
    if (std::getenv("BTFIELD_SWEEP_FOLDER") != nullptr) {
        std::string head = "| |", line = "|-|", bounds = "| at most |";
        for (const Way& way : ways) {
            std::ostringstream bound;
            bound << std::setprecision(2) << way.bound;
            head += " " + way.name + " |";
            line += "-|";
            bounds += " " + bound.str() + " |";
        }
        std::cout << head << '\n' << line << '\n' << bounds << std::endl;
    }
    for (const fs::path& path : pictures()) sweep(path);
    EXPECT_GE(written_, 40);
}

}  // namespace
}  // namespace btfield
