// `btfield btf` as users' scripts see it.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "btfield/btf_model.hpp"
#include "btfield/btf_set.hpp"
#include "btfield/height.hpp"
#include "btfield/image_io.hpp"
#include "tests/cli_cases.hpp"
#include "tests/rendering_cases.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::btfield;
using test::expect_failure;
using test::expect_keys;
using test::expect_object;
using test::expect_seconds;
using test::Words;

void put(const fs::path& path, const Image& image, PixelType type) {
    WriteOptions how;
    how.source = type;
    how.type = type;
    how.keep_values = true;
    static_cast<void>(write_picture(path, image, how));
}

/// Waves of 24 x 16 pixels as colour.png, normal.png, height.png and height.exr, and a few directions.
class CliBtf : public testing::Test {
  protected:
    CliBtf() {
        put_maps(0.0F);
        test::put_bytes(at("directions.txt"),
                        "# a few\nview 0 0\n45 60  # both\n\nview 67.5 -90\nlight 0 0\n");
    }
    /// \param rough  of height in pixels, and a tenth of it of colours
    void put_maps(float rough) {
        Image height({16, 24}, 1), colour({16, 24}, 3, ColourSpace::srgb);
        std::uint32_t state = 7;
        for (int r = 0; r < 16; ++r)
            for (int c = 0; c < 24; ++c) {
                state = state * 1664525U + 1013904223U;
                const float change = rough * static_cast<float>(state >> 8) / 16777216.0F;
                height.at(0, r, c) =
                    change +
                    static_cast<float>(1.5 * std::cos(2.0 * std::numbers::pi * (c / 24.0 + r / 8.0)));
                for (int p = 0; p < 3; ++p)
                    colour.at(p, r, c) = 0.6F + 0.1F * change + 0.02F * static_cast<float>((r + c + p) % 8);
            }
        put(at("height.exr"), height, PixelType::float32);
        put(at("height.png"), encode_height(height, 4.0), PixelType::uint16);
        put(at("normal.png"),
            encode_normals(normals_of_slopes(slopes_of_height(height, SurfaceEdges::periodic))),
            PixelType::uint16);
        put(at("colour.png"), colour, PixelType::uint8);
    }
    [[nodiscard]] std::string at(const std::string& name) const { return (folder_.path() / name).string(); }
    [[nodiscard]] Words make(const std::string& set, Words more = {}) const {
        Words words{"btf", "make",  at("colour.png"), at("normal.png"),    at("height.png"),
                    "-o",  at(set), "--directions",   at("directions.txt")};
        words.insert(words.end(), more.begin(), more.end());
        return words;
    }
    test::TemporaryFolder folder_;
};

TEST_F(CliBtf, MadeSetsAreReadAsTheyWereMade) {
    Words words = make("set");
    const json made = expect_object(words);
    expect_keys(made,
                {"format", "size", "views", "lights", "missing", "duplicates", "colour", "bytes", "planes",
                 "pictures", "output", "exposure", "clamped_pixels", "relief", "height_scale", "device"});
    expect_seconds(made, {"setup", "write", "total"});
    EXPECT_EQ(made["size"], json::array({24, 16}));
    EXPECT_EQ(made["views"], 3);
    EXPECT_EQ(made["lights"], 2);
    // The height's scale comes from the normals.
    EXPECT_NEAR(made["height_scale"].get<double>(), 4.0, 0.01);
    EXPECT_NEAR(made["relief"].get<double>(), 3.0, 0.02);
    EXPECT_TRUE(fs::is_regular_file(at("set/tv067.5_pv270/tl045_pl060_tv067.5_pv270.png")));

    const json info = expect_object({"btf", "info", at("set")});
    expect_keys(info, {"format", "size", "views", "lights", "missing", "duplicates", "colour", "bytes"});
    EXPECT_EQ(info["format"], "utia");
    EXPECT_EQ(info["pictures"], 6);
    EXPECT_EQ(info["missing"], 0);
    EXPECT_EQ(info["duplicates"], 0);
    EXPECT_EQ(info["colour"], "linear");
    EXPECT_EQ(info["height"], true);
    EXPECT_EQ(info["bytes"], made["bytes"]);

    const BtfSet set = BtfSet::open(at("set"));
    EXPECT_NEAR(set.description().height.at(0, 0, 0), 1.5, 0.01);
    const Image above = set.picture(0, 0);
    EXPECT_GT(above.at(0, 3, 3), 0.2F);
}

TEST_F(CliBtf, FloatsAndExposureKeepTheLight) {
    static_cast<void>(expect_object(make("png")));
    const json made = expect_object(make("exr", {"--type", "float", "--exposure", "0.25"}));
    EXPECT_EQ(made["exposure"], 0.25);
    const BtfSet eight = BtfSet::open(at("png")), floats = BtfSet::open(at("exr"));
    EXPECT_EQ(floats.space(), ColourSpace::linear);
    for (const BtfPair& pair : eight.pictures()) {
        const Image a = eight.picture(pair.view, pair.light), b = floats.picture(pair.view, pair.light);
        for (std::size_t i = 0; i < a.values().size(); ++i)
            // Half a step of 8 bits of sRGB, at its steepest.
            ASSERT_NEAR(a.values()[i], std::min(b.values()[i], 1.0F), 0.5 * 2.3 / 255.0);
    }
}

TEST_F(CliBtf, MapsTellWhatOthersDoNot) {
    // Without a height map: that of the normals; without normals: those of the height.
    const json normals = expect_object({"btf", "make", at("colour.png"), at("normal.png"), "-o", at("a"),
                                        "--directions", at("directions.txt")});
    EXPECT_NEAR(normals["relief"].get<double>(), 3.0, 0.05);
    const json height =
        expect_object({"btf", "make", at("colour.png"), at("height.png"), "-o", at("b"), "--relief",
                       "0.1666666", "--directions", at("directions.txt"), "--matt"});
    EXPECT_NEAR(height["relief"].get<double>(), 3.0, 0.02);
    const json pixels = expect_object({"btf", "make", at("colour.png"), at("height.exr"), "-o", at("c"),
                                       "--shrink", "2", "--directions", at("directions.txt")});
    EXPECT_EQ(pixels["size"], json::array({12, 8}));
    EXPECT_NEAR(pixels["relief"].get<double>(), 1.5, 0.4);
    EXPECT_NE(btfield({"btf", "info", at("c")}).out.find("3 views x 2 lights"), std::string::npos);
}

TEST_F(CliBtf, ConvertsBetweenFormats) {
    static_cast<void>(expect_object(make("set", {"--type", "half"})));
    const json file = expect_object({"btf", "convert", at("set"), "-o", at("set.tbig")});
    expect_keys(file, {"format", "size", "views", "lights", "missing", "duplicates", "colour", "bytes",
                       "output", "exposure", "clamped_pixels"});
    EXPECT_EQ(file["format"], "tbig");
    EXPECT_EQ(file["bytes"], fs::file_size(at("set.tbig")));
    // Halves to halves: to the bit.
    const BtfSet one = BtfSet::open(at("set")), other = BtfSet::open(at("set.tbig"));
    for (const BtfPair& pair : one.pictures()) {
        const Image a = one.picture(pair.view, pair.light), b = other.picture(pair.view, pair.light);
        ASSERT_TRUE(std::ranges::equal(a.values(), b.values()));
    }
    const json part = expect_object({"btf", "convert", at("set.tbig"), "-o", at("part"), "--format",
                                     "ubo2003", "--view-stride", "2", "--crop", "4,2,8,6"});
    EXPECT_EQ(part["pictures"], 4);
    EXPECT_EQ(part["size"], json::array({8, 6}));
    EXPECT_EQ(expect_object({"btf", "info", at("part")})["format"], "ubo2003");
    const json factored =
        expect_object({"btf", "convert", at("set"), "-o", at("set.btf"), "--components", "2"});
    EXPECT_EQ(factored.at("format"), "ubo2014-fmf");
    EXPECT_EQ(factored.at("components"), 2);
    EXPECT_GT(factored.at("relative_error"), 0.0);
    EXPECT_LT(factored.at("relative_error"), 0.2);
    EXPECT_TRUE(BtfSet::open(at("set.btf")).description().height.planes() == 1);
    expect_failure({"btf", "convert", at("set"), "-o", at("y.tbig"), "--components", "2"}, 2,
                   "--components: of .btf alone; tbig keeps pictures as they are");
    expect_failure({"btf", "convert", at("set"), "-o", at("set")}, 1, "that is the input");
    expect_failure({"btf", "convert", at("set"), "-o", at("set/part")}, 1, "it lies in the input");
    expect_failure({"btf", "convert", at("set"), "-o", at("x.mif"), "--exposure", "2"}, 1,
                   "the exposure is not 1");
    EXPECT_FALSE(fs::exists(at("x.mif")));
    // Names that were meant to be something else are no folders; what is there stays.
    for (const char* name : {"x.tbgi", "x.png", "x.bdi"})
        expect_failure({"btf", "convert", at("set"), "-o", at(name)}, 1, "no file of a set ends in");
    const std::string before = test::bytes_of(at("set.tbig"));
    const Words again{"btf", "convert", at("set"), "-o", at("set.tbig"), "--view-stride", "2"};
    expect_failure(again, 1, "the file exists");
    EXPECT_EQ(test::bytes_of(at("set.tbig")), before);
    Words over = again;
    over.emplace_back("--overwrite");
    static_cast<void>(expect_object(over));
    EXPECT_LT(fs::file_size(at("set.tbig")), before.size());
    static_cast<void>(expect_object({"btf", "convert", at("set"), "-o", at("bark.v2/")}));
    EXPECT_TRUE(fs::is_regular_file(at("bark.v2/btf.json")));
}

TEST_F(CliBtf, WhatCannotBeMadeIsOneLine) {
    expect_failure({"btf", "make", at("colour.png"), at("height.png"), "-o", at("x")}, 1,
                   "nothing tells how high the height map is");
    expect_failure({"btf", "make", at("normal.png"), "-o", at("x")}, 1, "none of the maps is colour");
    expect_failure({"btf", "make", at("colour.png"), "-o", at("x")}, 1,
                   "none of the maps is normal or height");
    expect_failure(make("x", {"--roughness", "2"}), 1, "roughness is 2");
    expect_failure(make("x", {"--roles", "colour"}), 2, "there are 1 for 3 maps");
    expect_failure(make("x", {"--format", "ubo2003", "--type", "half"}), 1, "JPEG cannot hold half");
    test::put_bytes(at("bad.txt"), "0 0\n95 0\n");
    expect_failure(
        {"btf", "make", at("colour.png"), at("normal.png"), "-o", at("x"), "--directions", at("bad.txt")}, 1,
        "line 2");
    expect_failure(
        {"btf", "make", at("colour.png"), at("normal.png"), "-o", at("x"), "--directions", at("none.txt")}, 1,
        "it cannot be opened");
    EXPECT_FALSE(fs::exists(at("x")));
    expect_failure({"btf", "info", at("nowhere")}, 1, "there is no such file or folder");
    fs::create_directories(at("full"));
    test::put_bytes(at("full/letter.txt"), "mine");
    expect_failure(make("full"), 1, "the folder is not empty");
    static_cast<void>(expect_object(make("full", {"--overwrite"})));
    test::put_bytes(at("full/btf.json"), R"({"format": "btfield-btf", "version": 1, "exposure": 0})");
    expect_failure({"btf", "info", at("full")}, 1, "its 'exposure' is no number above 0");
    test::put_bytes(at("full/btf.json"), R"({"format": "btfield-btf", "version": 2})");
    expect_failure({"btf", "info", at("full")}, 1, "its version is not 1");
}

/// A made set of 9 views and lights.
class CliBtfModel : public CliBtf {
  protected:
    CliBtfModel() {
        put_maps(1.0F);  // a field of pure waves takes long to certify
        std::string directions = "0 0\n";
        for (const int theta : {30, 60})
            for (int phi = 0; phi < 360; phi += 90)
                directions += std::to_string(theta) + " " + std::to_string(phi) + "\n";
        test::put_bytes(at("directions.txt"), directions);
        static_cast<void>(expect_object(make("set")));
    }
    [[nodiscard]] Words fit(const std::string& model, Words more = {}) const {
        Words words{"btf", "fit", at("set"), "-o", at(model), "--periodic", "--planes", "4"};
        words.insert(words.end(), more.begin(), more.end());
        return words;
    }
};

TEST_F(CliBtfModel, FitsAndGrows) {
    const json fitted = expect_object(fit("m.btfm", {"--leave-out", "9", "--levels", "1", "--order", "1"}));
    expect_keys(fitted,
                {"output", "method", "planes", "unexplained", "clusters", "pictures", "relief", "left_out",
                 "model", "structure_distance", "valid", "bytes", "compression_ratio", "device"});
    expect_seconds(fitted, {"total"});
    // Waves, which a field of order 1 has none of.
    EXPECT_GT(fitted["structure_distance"], 0.16);
    const std::string told =
        btfield(fit("told.btfm", {"--leave-out", "9", "--levels", "1", "--order", "1"})).out;
    EXPECT_NE(told.find("Grown surfaces lose shapes"), std::string::npos) << told;
    EXPECT_NE(told.find("--model roll"), std::string::npos) << told;
    // Patches of so small a surface keep little, and there is nothing better to name.
    const std::string rolled = btfield(fit("rolled.btfm", {"--model", "roll"})).out;
    EXPECT_NE(rolled.find("Grown surfaces keep shapes in part: structure distance 0."), std::string::npos)
        << rolled;
    EXPECT_EQ(rolled.find("--model"), std::string::npos) << rolled;
    EXPECT_EQ(fitted["method"], "joint");
    EXPECT_EQ(fitted["planes"], 4);
    EXPECT_EQ(fitted["pictures"], 72);
    EXPECT_EQ(fitted["relief"]["from"], "set");
    EXPECT_EQ(fitted["left_out"]["directions"], 9);
    EXPECT_LT(fitted["left_out"]["pixels_median"], fitted["left_out"]["nearest"]["pixels_median"]);
    EXPECT_EQ(fitted["bytes"], fs::file_size(at("m.btfm")));

    const json info = expect_object({"btf", "info", at("m.btfm")});
    expect_keys(info, {"format", "size", "planes", "views", "lights", "pictures", "colour", "white",
                       "surface_planes", "model", "valid", "unexplained", "relief", "bytes", "parts",
                       "compression_ratio", "file_ratio"});
    EXPECT_EQ(info["pictures"], 72);
    EXPECT_EQ(info["kept_pictures"], fitted["kept_pictures"]);
    EXPECT_EQ(info["parts"]["weights"], info["kept_pictures"].get<int>() * 3 * 4);
    EXPECT_EQ(info["parts"]["mean"].get<int>() + info["parts"]["contrast"].get<int>() +
                  info["parts"]["weights"].get<int>() + info["parts"]["field"].get<int>(),
              info["bytes"]);
    expect_failure({"info", at("m.btfm")}, 1, "btf info");
    expect_failure({"synth", at("m.btfm"), "-o", at("o.png")}, 1, "btf synth");

    const json one = expect_object({"btf", "synth", at("m.btfm"), "-o", at("one.png"), "--view", "20,40",
                                    "--light", "45,-90", "--size", "48x32", "--seed", "2"});
    expect_keys(one, {"outputs", "size", "seeds", "tileable", "clamped_pixels", "device"});
    expect_seconds(one, {"setup", "per_texture", "total"});
    const Image picture = read_picture(at("one.png")).image;
    EXPECT_EQ(picture.size(), (Size{32, 48}));
    EXPECT_EQ(picture.space(), ColourSpace::srgb);

    const json all =
        expect_object({"btf", "synth", at("m.btfm"), "-o", at("all"), "--all", "--type", "half"});
    EXPECT_EQ(all["pictures"], 81);
    const BtfSet grown = BtfSet::open(at("all"));
    EXPECT_EQ(grown.pictures().size(), 81U);
    EXPECT_EQ(grown.description().height.planes(), 1);
    // The same surface in the same direction is the same picture.
    const json same = expect_object(
        {"btf", "synth", at("m.btfm"), "-o", at("same.exr"), "--view", "30,90", "--light", "60,180"});
    EXPECT_EQ(same["size"], json::array({24, 16}));
    const Image a = read_picture(at("same.exr")).image;
    int view = -1, light = -1;
    for (int i = 0; i < 9; ++i) {
        if (angle_between(grown.views()[static_cast<std::size_t>(i)],
                          {std::numbers::pi / 6, std::numbers::pi / 2}) < 1e-3)
            view = i;
        if (angle_between(grown.lights()[static_cast<std::size_t>(i)],
                          {std::numbers::pi / 3, std::numbers::pi}) < 1e-3)
            light = i;
    }
    const Image b = grown.picture(view, light);
    for (std::size_t i = 0; i < a.values().size(); ++i) ASSERT_NEAR(a.values()[i], b.values()[i], 2e-3) << i;

    const json surface = expect_object({"btf", "synth", at("m.btfm"), "-o", at("s.exr"), "--surface"});
    const Image planes = read_picture(at("s.exr")).image;
    EXPECT_EQ(planes.planes(), 5);
    EXPECT_EQ(surface["tileable"], true);
}

TEST_F(CliBtfModel, TexturesOfClustersAndOfPictures) {
    const auto fit_by = [&](const std::string& model, Words more) {
        Words words{"btf", "fit", at("set"), "-o", at(model), "--levels", "1", "--order", "1"};
        words.insert(words.end(), more.begin(), more.end());
        return words;
    };
    const json segment =
        expect_object(fit_by("s.btfm", {"--method", "segment", "--clusters", "3", "--leave-out", "9"}));
    expect_keys(segment,
                {"output", "method", "planes", "unexplained", "clusters", "textures", "match", "pictures",
                 "relief", "left_out", "model", "valid", "bytes", "parts", "compression_ratio", "device"});
    expect_seconds(segment, {"pictures", "clusters", "textures", "score", "total"});
    EXPECT_EQ(segment["method"], "segment");
    EXPECT_EQ(segment["clusters"], 3);
    EXPECT_EQ(segment["textures"], 3);
    EXPECT_EQ(segment["match"], "means");
    EXPECT_EQ(segment["model"], "3d-msar");
    EXPECT_EQ(segment["pictures"], 72);
    EXPECT_EQ(segment["planes"], nullptr);
    EXPECT_EQ(segment["left_out"]["directions"], 9);
    EXPECT_LE(segment["left_out"]["mean_error"], segment["left_out"]["nearest"]["mean_error"]);
    EXPECT_EQ(segment["bytes"], fs::file_size(at("s.btfm")));

    const json each = expect_object(fit_by("e.btfm", {"--method", "each", "--jobs", "2"}));
    EXPECT_EQ(each["textures"], 81);
    EXPECT_EQ(each["clusters"], nullptr);
    EXPECT_EQ(each["resumed"], 0);
    EXPECT_EQ(each["model"], "3d-car");
    EXPECT_FALSE(fs::exists(at("e.btfm.part")));

    for (const char* model : {"s.btfm", "e.btfm"}) {
        const json info = expect_object({"btf", "info", at(model)});
        expect_keys(info, {"format", "method", "size", "planes", "views", "lights", "pictures", "colour",
                           "white", "textures", "match", "model", "valid", "bytes", "parts",
                           "compression_ratio", "file_ratio"});
        int parts = 0;
        for (const auto& [part, bytes] : info["parts"].items()) parts += bytes.get<int>();
        EXPECT_EQ(parts, info["bytes"]);
        EXPECT_EQ(info["parts"]["contrasts"], info["pictures"].get<int>() * 3);
        EXPECT_NE(btfield({"btf", "info", at(model)}).out.find("textures as 3d-"), std::string::npos);
        const json one = expect_object({"btf", "synth", at(model), "-o", at("one.exr"), "--view", "30,90",
                                        "--light", "60,180", "--size", "48x32"});
        expect_keys(one, {"outputs", "size", "seeds", "tileable", "clamped_pixels", "device"});
        EXPECT_EQ(read_picture(at("one.exr")).image.size(), (Size{32, 48}));
        expect_failure({"btf", "synth", at(model), "-o", at("x.exr"), "--surface"}, 1,
                       "textures of pictures");
        const json ball =
            expect_object({"btf", "render", at(model), "-o", at("ball.exr"), "--size", "48", "--overwrite"});
        EXPECT_EQ(ball["method"], info["method"]);
        EXPECT_GT(read_picture(at("ball.exr")).image.at(1, 16, 16), 0.1F);
        expect_failure({"btf", "view", at(model), "-o", at("x.html")}, 1, "--method joint");
    }
    const json all =
        expect_object({"btf", "synth", at("s.btfm"), "-o", at("all"), "--all", "--type", "half"});
    EXPECT_EQ(all["pictures"], 81);
    const BtfSet grown = BtfSet::open(at("all")), measured = BtfSet::open(at("set"));
    EXPECT_EQ(grown.description().height.planes(), 0);
    const auto mean = [](const Image& image) {
        double sum = 0.0;
        for (const float v : image.values()) sum += static_cast<double>(v);
        return sum / static_cast<double>(image.values().size());
    };
    EXPECT_NEAR(mean(grown.picture(3, 4)), mean(measured.picture(3, 4)), 0.02 * mean(measured.picture(3, 4)));

    expect_failure(fit_by("x.btfm", {"--method", "segment", "--planes", "3"}), 2,
                   "--planes goes with --method joint, not with segment");
    expect_failure(fit_by("x.btfm", {"--method", "each", "--clusters", "3"}), 2,
                   "--clusters goes with --method segment");
    expect_failure(fit_by("x.btfm", {"--match", "none"}), 2, "--match goes with --method segment or each");
    expect_failure(fit_by("x.btfm", {"--jobs", "2"}), 2, "--jobs goes with --method each");
    expect_failure(fit_by("x.btfm", {"--method", "each", "--periodic"}), 2, "--periodic");
    expect_failure(fit_by("x.btfm", {"--method", "segment", "--model", "compound"}), 2,
                   "--model compound goes with --method joint");
    test::put_bytes(at("x.btfm.part"), "mine\n");
    expect_failure(fit_by("x.btfm", {"--method", "each"}), 1, "it is no part of a BTF fit");
    EXPECT_EQ(test::bytes_of(at("x.btfm.part")), "mine\n");
    EXPECT_FALSE(fs::exists(at("x.btfm")));
}

TEST_F(CliBtfModel, RefusesWhatCannotBe) {
    expect_failure(fit("m.png"), 1, "name of a picture");
    expect_failure(fit("m.json", {"--height-scale", "3"}), 2, "--height");
    expect_failure(fit("m.json", {"--height", at("height.png")}), 1, "--height-scale");
    expect_failure(fit("m.json", {"--leave-out", "1"}), 1, "leave out");
    expect_failure(fit("m.json", {"--planes", "0"}), 2, "--planes");
    expect_failure({"btf", "synth", at("none.btfm"), "-o", at("o.png"), "--view", "0,0", "--light", "0,0"}, 1,
                   "none.btfm");
    test::put_bytes(at("m.json"), "{}");
    expect_failure({"btf", "synth", at("m.json"), "-o", at("o.png"), "--view", "0,0", "--light", "0,0"}, 1,
                   "format");
    expect_failure({"btf", "synth", at("m.json"), "-o", at("o.png"), "--view", "0,0"}, 2, "--light");
    expect_failure({"btf", "synth", at("m.json"), "-o", at("o.png")}, 2, "--view");
    expect_failure({"btf", "synth", at("m.json"), "-o", at("o.png"), "--view", "90,0", "--light", "0,0"}, 2,
                   "theta from 0 to 89");
    EXPECT_FALSE(fs::exists(at("o.png")));
}

/// A model of 24 x 16 pixels, without a fit.
class CliBtfShown : public CliBtf {
  protected:
    CliBtfShown() { write_btf_model(at("m.btfm"), test::smooth_btf({16, 24}, 3, 4)); }
};

TEST_F(CliBtfShown, RendersShapesAndSeries) {
    const json one = expect_object({"btf", "render", at("m.btfm"), "-o", at("ball.png"), "--size", "64x48"});
    expect_keys(one, {"outputs", "method", "shape", "size", "views", "lights", "tile", "tileable",
                      "tiles_around", "scale", "seed", "exposure", "gamma", "clamped_pixels", "device"});
    expect_seconds(one, {"setup", "per_picture", "write", "total"});
    EXPECT_EQ(one["shape"], "sphere");
    EXPECT_EQ(one["lights"], json::parse("[[45.0, 135.0]]"));
    EXPECT_EQ(one["gamma"], "srgb");
    EXPECT_EQ(one["tiles_around"], 6);  // 2 pi 0.45 48 / 24
    EXPECT_EQ(read_picture(at("ball.png")).image.size(), (Size{48, 64}));

    // A plane 1:1 from above is what synth shows.
    const Words light{"--light", "30,90", "--seed", "3"};
    const auto with = [&](Words words) {
        words.insert(words.end(), light.begin(), light.end());
        return words;
    };
    static_cast<void>(expect_object(with({"btf", "render", at("m.btfm"), "-o", at("plane.png"), "--shape",
                                          "plane", "--size", "24x16", "--exposure", "0.5"})));
    static_cast<void>(expect_object(
        with({"btf", "synth", at("m.btfm"), "-o", at("synth.png"), "--view", "0,0", "--exposure", "0.5"})));
    const Image plane = read_picture(at("plane.png")).image, synth = read_picture(at("synth.png")).image;
    for (std::size_t i = 0; i < plane.values().size(); ++i)
        ASSERT_NEAR(plane.values()[i], synth.values()[i], 1.01F / 255.0F) << i;
    // Linear light, and a power.
    const json linear = expect_object(with({"btf", "render", at("m.btfm"), "-o", at("plane.exr"), "--shape",
                                            "plane", "--size", "24x16", "--exposure", "0.5"}));
    EXPECT_EQ(linear["gamma"], 1.0);
    static_cast<void>(expect_object(with({"btf", "render", at("m.btfm"), "-o", at("power.png"), "--shape",
                                          "plane", "--size", "24x16", "--exposure", "0.5", "--gamma", "3"})));
    ReadOptions as_it_is;
    as_it_is.keep_values = true;
    const Image light_of = read_picture(at("plane.exr")).image,
                power = read_picture(at("power.png"), as_it_is).image;
    for (std::size_t i = 0; i < power.values().size(); ++i)
        // Half a step of 8 bits, and of half floats.
        ASSERT_NEAR(power.values()[i], std::cbrt(light_of.values()[i]), 2.5e-3F) << i;

    // The light goes round and does not come twice to where it began; the view goes from here to there.
    const json turn = expect_object({"btf", "render", at("m.btfm"), "-o", at("turn.png"), "--size", "32",
                                     "--light", "60,0:60,360", "--view", "0,0:30,90:60,90", "--frames", "4"});
    EXPECT_EQ(turn["outputs"].size(), 4U);
    EXPECT_EQ(turn["lights"], json::parse("[[60.0, 0.0], [60.0, 90.0], [60.0, 180.0], [60.0, 270.0]]"));
    EXPECT_EQ(turn["views"], json::parse("[[0.0, 0.0], [20.0, 60.0], [40.0, 90.0], [60.0, 90.0]]"));
    for (const char* name : {"turn-0.png", "turn-3.png"}) EXPECT_TRUE(fs::exists(at(name)));
    EXPECT_FALSE(fs::exists(at("turn.png")));
}

TEST_F(CliBtfShown, MakesAPage) {
    const json page = expect_object(
        {"btf", "view", at("m.btfm"), "-o", at("page.html"), "--size", "32x24", "--planes", "3"});
    expect_keys(page, {"output", "bytes", "size", "planes", "tileable", "seed", "device"});
    expect_seconds(page, {"setup", "page", "total"});
    EXPECT_EQ(page["size"], json::array({32, 24}));
    EXPECT_EQ(page["planes"], 3);
    EXPECT_EQ(page["bytes"], fs::file_size(at("page.html")));
    EXPECT_NE(test::bytes_of(at("page.html")).find("<title>m</title>"), std::string::npos);
    expect_failure({"btf", "view", at("m.btfm"), "-o", at("x.html"), "--planes", "5"}, 1, "the model has 4");
    expect_failure({"btf", "view", at("m.btfm"), "-o", at("m.btfm")}, 1, "that is the model");
    expect_failure({"btf", "view", at("m.btfm"), "-o", at("nowhere/x.html")}, 1, "nowhere");
    expect_failure({"btf", "view", at("m.btfm"), "-o", at("x.png")}, 1, "HTML");
    EXPECT_FALSE(fs::exists(at("x.html")));
    const Words render{"btf", "render", at("m.btfm"), "-o", at("x.png")};
    const auto refused = [&](const Words& more, int code, const std::string& part) {
        Words words = render;
        words.insert(words.end(), more.begin(), more.end());
        expect_failure(words, code, part);
    };
    refused({"--frames", "3"}, 2, "nothing moves");
    refused({"--light", "0,0:30,0"}, 2, "--frames");
    refused({"--light", "0,0:30"}, 2, "--light");
    refused({"--view", "89.5,0"}, 1, "89 degrees");
    refused({"--gamma", "0"}, 2, "--gamma");
    refused({"--exposure", "1e300"}, 2, "--exposure");
    refused({"--shape", "cube"}, 2, "plane|sphere");
    expect_failure({"btf", "render", at("m.btfm"), "-o", at("x.exr"), "--gamma", "2.2"}, 2, "linear light");
    EXPECT_FALSE(fs::exists(at("x.png")));
    for (const char* command : {"render", "view"}) {
        expect_failure({"btf", command, at("colour.png"), "-o", at("x.html")}, 1, "colour.png");
        expect_failure({"btf", command, at("none.btfm"), "-o", at("x.png")}, 1, "none.btfm");
    }
}

}  // namespace
}  // namespace btfield
