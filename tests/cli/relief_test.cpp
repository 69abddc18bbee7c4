// `btfield relief` as users' scripts see it.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "btfield/height.hpp"
#include "btfield/image_io.hpp"
#include "tests/cli_cases.hpp"
#include "tests/device_cases.hpp"
#include "tests/json_text.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::btfield;
using test::bytes_of;
using test::expect_failure;
using test::expect_keys;
using test::expect_object;
using test::expect_seconds;
using test::Surroundings;
using test::TemporaryFolder;
using test::Words;

/// Periodic, 96 × 64, from −3 to 3 or so.
Image waves() {
    Image height({64, 96}, 1);
    for (int r = 0; r < 64; ++r)
        for (int c = 0; c < 96; ++c)
            height.at(0, r, c) =
                static_cast<float>(2.0 * std::cos(2.0 * std::numbers::pi * (2 * c / 96.0 + r / 64.0)) +
                                   std::sin(2.0 * std::numbers::pi * (c / 96.0 - 3 * r / 64.0)));
    return height;
}

void put(const std::filesystem::path& path, const Image& image, PixelType type) {
    WriteOptions how;
    how.source = type;
    how.type = type;
    how.keep_values = true;
    write_picture(path, image, how);
}

/// normal.png, directx.png and normal.exr of the waves, height8.png of them in 8 bits.
class CliRelief : public testing::Test {
  protected:
    CliRelief() {
        const Image normals = normals_of_slopes(slopes_of_height(height_, SurfaceEdges::periodic));
        put(folder_ / "normal.png", encode_normals(normals), PixelType::uint16);
        put(folder_ / "directx.png", encode_normals(normals, NormalConvention::directx), PixelType::uint16);
        put(folder_ / "normal.exr", normals, PixelType::float32);
        put(folder_ / "height8.png", encode_height(height_, encoded_height_scale(height_)), PixelType::uint8);
    }
    [[nodiscard]] Picture read(const std::string& name) const {
        ReadOptions how;
        how.keep_values = true;
        return read_picture(folder_ / name, how);
    }
    /// Largest difference of a picture, less `zero` and multiplied by `scale`, from the waves.
    [[nodiscard]] double error(const Image& image, double zero = 0.0, double scale = 1.0) const {
        EXPECT_EQ(image.size(), height_.size());
        EXPECT_EQ(image.planes(), 1);
        double most = 0.0;
        for (std::size_t i = 0; i < image.values().size(); ++i)
            most = std::max(most, std::abs((static_cast<double>(image.values()[i]) - zero) * scale -
                                           static_cast<double>(height_.values()[i])));
        return most;
    }

    TemporaryFolder folder_;
    Surroundings here_{.folder = folder_.path().string()};
    Image height_ = waves();
};

TEST_F(CliRelief, IntegratesInPixels) {
    const json object =
        expect_object({"relief", "integrate", "normal.exr", "-o", "h.exr", "--periodic"}, here_);
    expect_keys(object, {"height", "side_file", "size", "range", "scale", "periodic", "device", "seconds"});
    expect_seconds(object, {"read", "integrate", "write", "total"});
    EXPECT_EQ(object["height"], "h.exr");
    EXPECT_EQ(object["size"], json::array({96, 64}));
    EXPECT_EQ(object["periodic"], true);
    const Picture made = read("h.exr");
    EXPECT_EQ(made.type, PixelType::float32);
    EXPECT_LE(error(made.image), 1e-4 * 6.0);
    EXPECT_NEAR(object["range"].get<double>(), 6.0, 0.2);
}

TEST_F(CliRelief, IntegratesInSixteenBits) {
    for (const Words& from : {Words{"normal.png"}, Words{"directx.png", "--convention", "directx"}}) {
        Words words{"relief", "integrate"};
        words.insert(words.end(), from.begin(), from.end());
        words.insert(words.end(), {"-o", "h.png", "--periodic"});
        const json object = expect_object(words, here_);
        const json side = test::parsed(bytes_of(folder_ / "h.json"));
        EXPECT_EQ(side["size"], json::array({96, 64}));
        EXPECT_EQ(side["mid_grey"], 32768);
        EXPECT_EQ(side["edges"], "periodic");
        EXPECT_EQ(side["scale"], object["scale"]);
        const Picture made = read("h.png");
        EXPECT_EQ(made.type, PixelType::uint16);
        // A step of 16 bits in normals is one of 3e-5 in slopes, which waves of 96 pixels sum up over 15.
        EXPECT_LE(error(made.image, mid_grey, side["scale"].get<double>()), 2e-3);
    }
    EXPECT_EQ(btfield({"relief", "integrate", "normal.png", "-o", "m.png"}, here_).code, 0);
    EXPECT_EQ(test::parsed(bytes_of(folder_ / "m.json"))["edges"], "mirror");
}

TEST_F(CliRelief, TakesACoarseHeight) {
    const json object = expect_object({"relief", "integrate", "normal.png", "-o", "h.exr", "--periodic",
                                       "--coarse", "height8.png", "--coarse-from", "32"},
                                      here_);
    // The map's scale is found from the normals: black and white of 8 bits are as far apart as of 16.
    EXPECT_NEAR(object["coarse_scale"].get<double>(), encoded_height_scale(height_),
                0.02 * encoded_height_scale(height_));
    // Half of a step of 8 bits, where the coarse height decides.
    EXPECT_LE(error(read("h.exr").image), encoded_height_scale(height_) / 255.0);
}

TEST_F(CliRelief, RefusalsLeaveNothing) {
    const Words before = folder_.names();
    const auto refused = [&](Words words, int code, const std::string& part) {
        words.insert(words.begin(), {"relief", "integrate"});
        expect_failure(words, code, part, here_);
        EXPECT_EQ(folder_.names(), before);
    };
    refused({"absent.png", "-o", "h.png"}, 1, "absent.png");
    refused({"height8.png", "-o", "h.png"}, 1, "1 plane");
    refused({"normal.png", "-o", "h.jpg"}, 2, "h.jpg");
    refused({"normal.png", "-o", "normal.png"}, 1, "that is the normal map");
    refused({"normal.png", "-o", "absent/h.png"}, 1, "absent");
    refused({"normal.png", "-o", "h.png", "--coarse", "normal.png"}, 1, "3 planes");
    refused({"normal.png", "-o", "h.png", "--coarse-from", "9"}, 2, "--coarse");
    refused({"normal.png", "-o", "h.png", "--coarse", "height8.png", "--coarse-from", "2"}, 1, "4 pixels");
    refused({"normal.png", "-o", "h.png", "--crop", "90,0,10,10"}, 1, "normal.png");
    // Heights of the other sign: the slopes are against each other.
    refused({"normal.png", "-o", "h.png", "--convention", "directx", "--coarse", "height8.png", "--crop",
             "0,0,40,16"},
            1, "height8.png");
}

}  // namespace
}  // namespace btfield
