// `btfield relief` as users' scripts see it.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "btfield/height.hpp"
#include "btfield/image_io.hpp"
#include "tests/cli_cases.hpp"
#include "tests/device_cases.hpp"
#include "tests/json_text.hpp"
#include "tests/light_cases.hpp"
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

class CliReliefFit : public testing::Test {
  protected:
    CliReliefFit() { test::put_lights(folder_ / "stack", {20, 30}, 24, 3, PixelType::uint16, ".png"); }
    void refused(Words words, int code, const std::string& part) {
        const Words before = folder_.names();
        words.insert(words.begin(), {"relief", "fit"});
        expect_failure(words, code, part, here_);
        EXPECT_EQ(folder_.names(), before);
    }
    TemporaryFolder folder_;
    Surroundings here_{.folder = folder_.path().string()};
};

TEST_F(CliReliefFit, WritesAllMaps) {
    const json object = expect_object({"relief", "fit", "stack/dirs.lp", "-o", "out", "--maps"}, here_);
    expect_keys(object, {"normals",        "height",
                         "height_pixels",  "albedo",
                         "side_file",      "residual_map",
                         "left_out_map",   "size",
                         "robust",         "coding",
                         "lights",         "residual",
                         "left_out_error", "left_out_error_ls",
                         "shadowed",       "saturated",
                         "albedo_scale",   "range",
                         "scale",          "periodic",
                         "device",         "seconds"});
    expect_seconds(object, {"read", "fit", "integrate", "write", "total"});
    EXPECT_EQ(object["lights"], 24);
    EXPECT_EQ(object["coding"], "linear");
    EXPECT_LE(object["left_out_error"].get<double>(), 0.01);
    ReadOptions how;
    how.keep_values = true;
    const Picture normals = read_picture(folder_ / "out/normal.png", how);
    EXPECT_EQ(normals.type, PixelType::uint16);
    EXPECT_LE(test::mean_angle(decode_normals(normals), test::hilly_normals({20, 30})), 0.1);
    const json side = test::parsed(bytes_of(folder_ / "out/relief.json"));
    EXPECT_EQ(side["normals"], "opengl");
    EXPECT_EQ(side["scale"], object["scale"]);
    // Both heights are one, and its slopes are those of the normals but for a plane and the noise.
    const Picture coded = read_picture(folder_ / "out/height.png", how);
    const Picture pixels = read_picture(folder_ / "out/height.exr", how);
    const double scale = side["scale"].get<double>();
    for (std::size_t i = 0; i < 600; ++i)
        EXPECT_NEAR((static_cast<double>(coded.image.values()[i]) - mid_grey) * scale,
                    static_cast<double>(pixels.image.values()[i]), scale / 65535.0);
    EXPECT_EQ(read_picture(folder_ / "out/residual.exr").image.planes(), 1);
    EXPECT_EQ(read_picture(folder_ / "out/left-out.exr").image.size(), (Size{20, 30}));
    // sRGB in a PNG: what its readers take it for.
    const Picture albedo = read_picture(folder_ / "out/albedo.png");
    EXPECT_EQ(albedo.type, PixelType::uint16);
    const double linear = std::pow((static_cast<double>(albedo.image.at(1, 4, 4)) + 0.055) / 1.055, 2.4);
    EXPECT_NEAR(linear, test::albedo_at(1, 4, 4), 0.01);

    const std::string before = bytes_of(folder_ / "out/normal.png");
    ASSERT_EQ(btfield({"relief", "fit", "stack", "-o", "out"}, here_).code, 0);
    EXPECT_EQ(bytes_of(folder_ / "out/normal.png"), before);
    ASSERT_EQ(btfield({"relief", "fit", "stack", "-o", "out", "--convention", "directx"}, here_).code, 0);
    const Picture directx = read_picture(folder_ / "out/normal.png", how);
    EXPECT_NEAR(directx.image.at(1, 3, 3), 1.0F - normals.image.at(1, 3, 3), 2.0F / 65535.0F);
}

TEST_F(CliReliefFit, RulesByName) {
    for (const char* rule : {"ls", "ranks", "ranks:30:80", "huber", "amb", "lobe"}) {
        const json object = expect_object(
            {"relief", "fit", "stack", "-o", "out/", "--robust", rule, "--crop", "2,2,9,7"}, here_);
        EXPECT_EQ(object["robust"], std::string(rule).substr(0, 5) == "ranks" ? "ranks" : rule);
        EXPECT_EQ(object["size"], json::array({9, 7}));
        EXPECT_EQ(object.contains("roughness"), std::string(rule) == "lobe");
    }
}

/// The picture that a viewer of info.json makes under a light: for each colour Σ w (c − bias) scale, c being
/// values of plane_0.jpg to plane_5.jpg as parts of white, w = 1, x, y, x², xy, y².
Image viewed(const std::filesystem::path& folder, const test::Direction& light) {
    const json info = test::parsed(bytes_of(folder / "info.json"));
    EXPECT_EQ(info["type"], "ptm");
    EXPECT_EQ(info["colorspace"], "rgb");
    EXPECT_EQ(info["format"], "jpg");
    EXPECT_EQ(info["nplanes"], 18);
    EXPECT_EQ(info["materials"].size(), 1U);
    const json &scale = info["materials"][0]["scale"], &bias = info["materials"][0]["bias"];
    EXPECT_EQ(scale.size(), 18U);
    EXPECT_EQ(bias.size(), 18U);
    const double x = light[0], y = light[1];
    const std::vector<double> weights{1.0, x, y, x * x, x * y, y * y};
    Image seen({info["height"].get<int>(), info["width"].get<int>()}, 3);
    for (std::size_t t = 0; t < 6; ++t) {
        const Picture plane = read_picture(folder / ("plane_" + std::to_string(t) + ".jpg"));
        EXPECT_EQ(plane.type, PixelType::uint8);
        EXPECT_EQ(plane.image.size(), seen.size());
        for (std::size_t p = 0; p < 3; ++p)
            for (std::size_t i = 0; i < area(seen.size()); ++i)
                seen.plane(static_cast<int>(p))[i] +=
                    static_cast<float>(weights[t] *
                                       (static_cast<double>(plane.image.plane(static_cast<int>(p))[i]) -
                                        bias[3 * t + p].get<double>()) *
                                       scale[3 * t + p].get<double>());
    }
    return seen;
}

/// Root mean square of viewed() less what was photographed, sRGB-encoded, over all lights.
double viewing_error(const std::filesystem::path& folder, const std::vector<test::Direction>& lights,
                     const std::filesystem::path& stack, double gain = 1.0) {
    double sum = 0.0, count = 0.0;
    for (std::size_t k = 0; k < lights.size(); ++k) {
        ReadOptions raw;
        raw.keep_values = true;
        const Image seen = viewed(folder, lights[k]);
        const Image there = read_picture(stack / ("light " + std::to_string(k) + ".png"), raw).image;
        for (std::size_t i = 0; i < seen.values().size(); ++i) {
            const double linear = gain * static_cast<double>(there.values()[i % there.values().size()]);
            const double expected =
                linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
            sum += std::pow(static_cast<double>(seen.values()[i]) - expected, 2.0);
            count += 1.0;
        }
    }
    return std::sqrt(sum / count);
}

TEST_F(CliReliefFit, ExportsForViewersOfRelightablePictures) {
    const json object = expect_object({"relief", "fit", "stack/dirs.lp", "-o", "out", "--export", "relight",
                                       "--pixel-size", "0.2", "--robust", "ls"},
                                      here_);
    ASSERT_EQ(object["exports"].size(), 7U);
    EXPECT_EQ(object["exports"][0], "out/relight/info.json");
    EXPECT_EQ(object["exports"][6], "out/relight/plane_5.jpg");
    const json info = test::parsed(bytes_of(folder_ / "out/relight/info.json"));
    EXPECT_EQ(info["pixelSizeInMM"], 0.2);
    const std::vector<test::Direction> lights = test::dome(24);
    ASSERT_EQ(info["lights"].size(), 72U);
    for (std::size_t k = 0; k < 72; ++k)
        EXPECT_NEAR(info["lights"][k].get<double>(), lights[k / 3][k % 3], 1e-5);
    const json side = test::parsed(bytes_of(folder_ / "out/relief.json"));
    EXPECT_EQ(side["relight_error"], object["relight_error"]);
    EXPECT_EQ(side["relight_white"], 1.0);
    EXPECT_EQ(side["pixel_size_mm"], 0.2);
    // What least squares leave, and 8 bits of six planes more: steps of up to 1/255 and a JPEG's.
    const double fit = object["relight_error"].get<double>();
    EXPECT_LT(fit, 0.03);
    const double whole = viewing_error(folder_ / "out/relight", lights, folder_ / "stack");
    EXPECT_GE(whole, 0.999 * fit);
    EXPECT_LE(whole, std::hypot(fit, 0.01));

    // Grey pictures are shown in grey.
    test::put_lights(folder_ / "grey", {20, 30}, 12, 1, PixelType::uint16, ".png");
    const json grey = expect_object(
        {"relief", "fit", "grey", "-o", "grey-out", "--export", "relight", "--robust", "ls"}, here_);
    EXPECT_LE(viewing_error(folder_ / "grey-out/relight", test::dome(12), folder_ / "grey"),
              std::hypot(grey["relight_error"].get<double>(), 0.01));
    refused({"stack", "-o", "new", "--export", "rti"}, 2, "relight");
    test::put_lights(folder_ / "few", {20, 30}, 5, 3, PixelType::uint16, ".png");
    refused({"few", "-o", "new", "--export", "relight"}, 1, "5 lights");
    test::put_lights(folder_ / "spectral", {20, 30}, 9, 4, PixelType::uint16, ".tif");
    refused({"spectral", "-o", "new", "--export", "relight"}, 1, "4 planes");
    EXPECT_EQ(expect_object({"relief", "fit", "spectral", "-o", "new", "--robust", "ls"}, here_)["albedo"],
              "new/albedo.exr");
    EXPECT_EQ(read_picture(folder_ / "new/albedo.exr").image.planes(), 4);
}

TEST_F(CliReliefFit, RendersUnderANewLight) {
    ASSERT_EQ(btfield({"relief", "fit", "stack", "-o", "out"}, here_).code, 0);
    const json object = expect_object(
        {"relief", "render", "out", "-o", "left.exr", "--light", "40,180", "--score", "stack/dirs.lp"},
        here_);
    expect_keys(object, {"outputs", "light", "size", "clamped_pixels", "score", "seconds"});
    EXPECT_EQ(object["outputs"], json::array({"left.exr"}));
    EXPECT_EQ(object["light"], json::array({40.0, 180.0}));
    EXPECT_EQ(object["size"], json::array({30, 20}));
    ASSERT_EQ(object["score"]["lights"].size(), 24U);
    EXPECT_EQ(object["score"]["lights"][3]["picture"], "light 3.png");
    EXPECT_LE(object["score"]["error"].get<double>(), 0.02);
    // What was photographed under that light, but for the shadows.
    const Image expected = test::lit(test::hilly_normals({20, 30}), 3,
                                     {.direction = {-std::sin(40.0 / 180.0 * std::numbers::pi), 0.0,
                                                    std::cos(40.0 / 180.0 * std::numbers::pi)}},
                                     1);
    const Image made = read_picture(folder_ / "left.exr").image;
    std::vector<float> errors;
    for (std::size_t i = 0; i < made.values().size(); ++i)
        errors.push_back(std::abs(made.values()[i] - expected.values()[i]));
    std::nth_element(errors.begin(), errors.begin() + 900, errors.end());
    EXPECT_LE(errors[900], 5e-3F);
    const json shades =
        expect_object({"relief", "render", "out", "--score", "stack/dirs.lp", "--no-shadows"}, here_);
    EXPECT_FALSE(shades.contains("outputs"));
    EXPECT_LE(shades["score"]["error"].get<double>(), 2e-3);

    const Words before = folder_.names();
    const auto refuse = [&](Words words, int code, const std::string& part) {
        words.insert(words.begin(), {"relief", "render"});
        expect_failure(words, code, part, here_);
        EXPECT_EQ(folder_.names(), before);
    };
    refuse({"out"}, 2, "--score");
    refuse({"out", "-o", "new.png"}, 2, "--light");
    refuse({"out", "--light", "20,0"}, 2, "--output");
    for (const char* light : {"90,0", "-1,0", "20", "20,x", "20,1,2"})
        refuse({"out", "-o", "new.png", "--light", light}, 2, light);
    refuse({"stack", "-o", "new.png", "--light", "20,0"}, 1, "relief.json");
    refuse({"out", "-o", "out/normal.png", "--light", "20,0"}, 1, "that is a map of the surface");
    refuse({"out", "--score", "stack", "--crop", "0,0,9,9"}, 1, "9 x 9");
    test::put_bytes(folder_ / "out/relief.json", "{\"edges\": \"mirror\", \"coding\": \"none\"}");
    refuse({"out", "-o", "new.png", "--light", "20,0"}, 1, "'coding'");
}

TEST_F(CliReliefFit, RefusalsLeaveNothing) {
    refused({"absent", "-o", "out"}, 1, "absent");
    refused({"stack", "-o", "stack/dirs.lp"}, 2, "no folder");
    for (const char* rule : {"best", "ranks:80:30", "ranks:1", "ls:1:2", "ranks:0:101"})
        refused({"stack", "-o", "out", "--robust", rule}, 2, rule);
    for (const char* coding : {"gamma", "gamma:0", "gamma:x", "srgb:2", "log"})
        refused({"stack", "-o", "out", "--coding", coding}, 2, coding);
    refused({"stack", "-o", "out", "--mask", "absent.png"}, 1, "absent.png");
    write_picture(folder_ / "stack/light 5.png", Image({7, 7}, 3));
    refused({"stack", "-o", "out"}, 1, "light 5.png");
    std::filesystem::remove(folder_ / "stack/light 5.png");
    refused({"stack", "-o", "out"}, 1, "line 7");
    test::put_bytes(folder_ / "stack/dirs.lp",
                    "3\nlight 1.png 1 0 1\nlight 2.png 0 0 1\nlight 3.png -1 0 1\n");
    refused({"stack", "-o", "out"}, 1, "one plane");
    test::put_bytes(folder_ / "stack/dirs.lp",
                    "3\nlight 1.png 1 0 1\nlight 2.png 0 1 1\nlight 3.png -1 0 -1\n");
    refused({"stack", "-o", "out"}, 1, "line 4: the light of 'light 3.png' is behind the surface");
    // Inputs stay: pictures under lights that have an output's name.
    std::filesystem::copy_file(folder_ / "stack/light 1.png", folder_ / "stack/normal.png");
    test::put_bytes(folder_ / "stack/dirs.lp",
                    "3\nnormal.png 1 0 1\nlight 2.png 0 1 1\nlight 3.png -1 0 1\n");
    refused({"stack", "-o", "stack"}, 1, "one of the pictures under lights");
}

}  // namespace
}  // namespace btfield
