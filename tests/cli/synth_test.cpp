// `btfield synth` as users' scripts see it: seeds, several models, raster recursion.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "btfield/image_io.hpp"
#include "btfield/model_file.hpp"
#include "tests/cli_cases.hpp"
#include "tests/example_model.hpp"
#include "tests/json_text.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::btfield;
using test::bytes_of;
using test::Ended;
using test::expect_failure;
using test::expect_object;
using test::put_model;
using test::Surroundings;
using test::TemporaryFolder;
using test::Words;

/// A folder for models, with the empty folder `out` in it.
class CliSynth : public testing::Test {
  protected:
    void put(const std::string& name, ModelKind kind, int planes, PixelType type = PixelType::uint8) {
        TextureModel model = test::example_model(kind, planes, 2);
        model.provenance.type = type;
        put_model(folder_ / name, model);
    }

    Ended synth(Words words) {
        words.insert(words.begin(), "synth");
        return btfield(std::move(words), here_);
    }

    json grow(Words words) {
        words.insert(words.begin(), "synth");
        return expect_object(std::move(words), here_);
    }

    /// As expect_failure, and nothing new in the folder `out`.
    void expect_refusal(Words words, int code, const std::string& part) {
        words.insert(words.begin(), "synth");
        expect_failure(words, code, part, here_);
        EXPECT_TRUE(std::filesystem::is_empty(folder_ / "out"));
    }

    void SetUp() override { std::filesystem::create_directory(folder_ / "out"); }

    TemporaryFolder folder_;
    const Surroundings here_{.folder = folder_.path().string()};
};

TEST_F(CliSynth, ManySeeds) {
    put_model(folder_ / "m.json");
    const json object =
        grow({"m.json", "-o", "t.v1.exr", "--count", "11", "--seed", "100", "--size", "16x8"});
    ASSERT_EQ(object["outputs"].size(), 11U);
    for (int i = 0; i < 11; ++i) {
        const auto n = static_cast<std::size_t>(i);
        EXPECT_EQ(object["outputs"][n],
                  std::string("t.v1-") + (i < 10 ? "0" : "") + std::to_string(i) + ".exr");
        EXPECT_EQ(object["seeds"][n], 100 + i);
        EXPECT_TRUE(std::filesystem::exists(folder_ / object["outputs"][n].get<std::string>()));
    }
    // Texture i is the texture of seed N + i, whatever batch it was in.
    grow({"m.json", "-o", "alone.exr", "--seed", "110", "--size", "16x8"});
    const Image alone = read_picture(folder_ / "alone.exr").image,
                last = read_picture(folder_ / "t.v1-10.exr").image;
    const Image first = read_picture(folder_ / "t.v1-00.exr").image;
    float largest = 0.0F, difference = 0.0F, others = 0.0F;
    for (std::size_t i = 0; i < alone.values().size(); ++i) {
        largest = std::max(largest, std::abs(alone.values()[i]));
        difference = std::max(difference, std::abs(alone.values()[i] - last.values()[i]));
        others = std::max(others, std::abs(alone.values()[i] - first.values()[i]));
    }
    // EXR holds halves (2^-11), and results of one seed agree to 1e-5 of full scale.
    EXPECT_LE(difference, largest * (1.0F / 2048.0F + 1e-5F));
    EXPECT_GT(others, difference);
    expect_failure({"synth", "m.json", "-o", "none/t.png", "--count", "3"}, 1, "none", here_);
}

TEST_F(CliSynth, ProfileGoesToStandardError) {
    put_model(folder_ / "m.json");
    const Ended ended = synth({"m.json", "-o", "t.png", "--size", "32x32", "--profile", "--json"});
    EXPECT_EQ(ended.code, 0);
    EXPECT_TRUE(test::holds_object(ended.out)) << ended.out;
    EXPECT_EQ(ended.err.rfind("kernel ", 0), 0U) << ended.err;
    EXPECT_NE(ended.err.find("fft"), std::string::npos) << ended.err;
}

TEST_F(CliSynth, NoiseDomainsDiffer) {
    put_model(folder_ / "m.json");
    grow({"m.json", "-o", "a.png", "--size", "32x32"});
    grow({"m.json", "-o", "b.png", "--size", "32x32", "--noise-domain", "spatial"});
    EXPECT_NE(bytes_of(folder_ / "a.png"), bytes_of(folder_ / "b.png"));
}

TEST_F(CliSynth, ClampedPixelsAreCounted) {
    TextureModel model = test::example_model(ModelKind::car3d, 3, 1);
    model.mean.assign(3, 1.5);  // 25 standard deviations above white
    put_model(folder_ / "m.json", model);
    EXPECT_EQ(grow({"m.json", "-o", "t.png", "--size", "20x10"})["clamped_pixels"], 200);
    EXPECT_EQ(grow({"m.json", "-o", "t.exr", "--size", "20x10"})["clamped_pixels"], 0);
}

TEST_F(CliSynth, SeveralModelsAtOnce) {
    put("colour.json", ModelKind::car3d, 3);
    put("light.btfm", ModelKind::msar2d, 1, PixelType::half);
    put("bands.json", ModelKind::ma3d, 5, PixelType::uint16);
    const json all =
        grow({"colour.json", "light.btfm", "bands.json", "-o", "out", "--size", "24x16", "--seed", "3"});
    ASSERT_EQ(all["syntheses"].size(), 3U);
    const Words expected{"out/colour.png", "out/light.exr", "out/bands.tif"};
    for (std::size_t i = 0; i < 3; ++i) {
        const json& one = all["syntheses"][i];
        for (const char* key :
             {"outputs", "size", "seeds", "tileable", "clamped_pixels", "device", "seconds"})
            EXPECT_TRUE(one.contains(key)) << key;
        EXPECT_EQ(one["outputs"], json::array({expected[i]}));
        EXPECT_EQ(one["size"], json::array({24, 16}));
        EXPECT_EQ(one["seeds"], json::array({3}));
    }
    EXPECT_EQ(read_picture(folder_ / expected[0]).image.planes(), 3);
    EXPECT_EQ(read_picture(folder_ / expected[1]).type, PixelType::half);
    EXPECT_EQ(read_picture(folder_ / expected[2]).image.planes(), 5);
    EXPECT_EQ(read_picture(folder_ / expected[2]).type, PixelType::uint16);
    // Each is what its model gives alone.
    grow({"colour.json", "-o", "alone.png", "--size", "24x16", "--seed", "3"});
    EXPECT_EQ(bytes_of(folder_ / "alone.png"), bytes_of(folder_ / expected[0]));
}

TEST_F(CliSynth, FoldersTakeNumberedNames) {
    put("a.json", ModelKind::car3d, 3);
    put("b.json", ModelKind::car3d, 1);
    const json one = grow({"a.json", "-o", "out", "--size", "8x8"});
    EXPECT_EQ(one["outputs"], json::array({"out/a.png"}));
    const json two = grow({"a.json", "b.json", "-o", "out", "--size", "8x8", "--count", "2"});
    EXPECT_EQ(two["syntheses"][0]["outputs"], json::array({"out/a-0.png", "out/a-1.png"}));
    EXPECT_EQ(two["syntheses"][1]["outputs"], json::array({"out/b-0.png", "out/b-1.png"}));
    for (const char* name : {"a.png", "a-0.png", "a-1.png", "b-0.png", "b-1.png"})
        EXPECT_TRUE(std::filesystem::exists(folder_ / "out" / name)) << name;
}

TEST_F(CliSynth, NothingIsWrittenWhenOneModelIsBad) {
    put("good.json", ModelKind::car3d, 3);
    put("average.json", ModelKind::ma3d, 3);
    put("good.btfm", ModelKind::car3d, 3);
    const std::string whole = bytes_of(folder_ / "good.json");
    test::put_bytes(folder_ / "half.json", whole.substr(0, whole.size() / 2));
    TextureModel invalid = test::example_model(ModelKind::msar3d, 3, 2);
    invalid.levels[1].certificate.valid = false;
    write_model(folder_ / "invalid.json", invalid);

    expect_refusal({"good.json", "absent.json", "-o", "out"}, 1, "absent.json");
    expect_refusal({"good.json", "half.json", "-o", "out"}, 1, "half.json");
    expect_refusal({"good.json", "invalid.json", "-o", "out"}, 1, "'invalid.json': ");
    expect_refusal({"good.json", "average.json", "-o", "out", "--method", "raster"}, 1, "'average.json': ");
    expect_refusal({"good.json", "good.btfm", "-o", "out"}, 2, "out/good.png");
    expect_refusal({"good.json", "average.json", "-o", "new.png"}, 2, "no folder");
    std::filesystem::create_directory(folder_ / "out/average.png");  // in the way of the second texture
    const Ended ended = synth({"good.json", "average.json", "-o", "out"});
    EXPECT_EQ(ended.code, 1);
    EXPECT_NE(ended.err.find("average.png"), std::string::npos) << ended.err;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out/good.png"));
}

TEST_F(CliSynth, Raster) {
    put("m.json", ModelKind::car2d, 3);
    const json grown = grow({"m.json", "-o", "raster.png", "--method", "raster", "--size", "32x16"});
    EXPECT_EQ(grown["tileable"], false);
    EXPECT_EQ(read_picture(folder_ / "raster.png").image.size(), (Size{16, 32}));
    grow({"m.json", "-o", "torus.png", "--method", "torus", "--size", "32x16"});
    grow({"m.json", "-o", "default.png", "--size", "32x16"});
    EXPECT_NE(bytes_of(folder_ / "raster.png"), bytes_of(folder_ / "torus.png"));
    EXPECT_EQ(bytes_of(folder_ / "default.png"), bytes_of(folder_ / "torus.png"));
    const Ended plain = synth({"m.json", "-o", "raster.png", "--method", "raster", "--size", "32x16"});
    EXPECT_EQ(plain.code, 0) << plain.err;
    EXPECT_NE(plain.out.find("does not tile"), std::string::npos) << plain.out;

    TextureModel growing = test::example_model(ModelKind::car3d, 1, 1);
    test::field_of(growing, 0).coefficients.assign(test::field_of(growing, 0).offsets.size(), 0.9);
    write_model(folder_ / "growing.json", growing);
    expect_refusal({"growing.json", "-o", "out/t.png", "--method", "raster"}, 1, "level 0");
    expect_refusal({"m.json", "-o", "out/t.png", "--method", "diagonal"}, 2, "torus|raster");
}

TEST_F(CliSynth, OneNumberIsASquare) {
    put("m.json", ModelKind::car3d, 1);
    EXPECT_EQ(grow({"m.json", "-o", "out/a.png", "--size", "48"})["size"], json::array({48, 48}));
}

TEST_F(CliSynth, WindowsOfOnePlaneContinueEachOther) {
    put("m.json", ModelKind::car3d, 3, PixelType::float32);
    const json all =
        grow({"m.json", "-o", "out/all.tif", "--size", "96x64", "--offset", "0,0", "--period", "96x64"});
    EXPECT_EQ(all["period"], json::array({96, 64}));
    EXPECT_EQ(all["tileable"], true);
    const Image plane = read_picture(folder_ / "out/all.tif").image;
    EXPECT_EQ(plane.values()[7], (grow({"m.json", "-o", "out/plain.tif", "--size", "96x64"}),
                                  read_picture(folder_ / "out/plain.tif").image.values()[7]));
    const json part = grow(
        {"m.json", "-o", "out/part.tif", "--size", "50x20", "--period", "96x64", "--offset", "-30,1000"});
    EXPECT_EQ(part["offset"], json::array({1000, -30}));
    EXPECT_EQ(part["tileable"], false);
    const Image window = read_picture(folder_ / "out/part.tif").image,
                expected = plane.window(1000, -30, {20, 50});
    for (std::size_t k = 0; k < window.values().size(); ++k)
        ASSERT_EQ(window.values()[k], expected.values()[k]);
    // A period that does not suit the pyramid becomes the next that does.
    const Ended shifted =
        synth({"m.json", "-o", "out/odd.png", "--size", "50x21", "--offset", "3,4", "--json"});
    ASSERT_EQ(shifted.code, 0) << shifted.err;
    EXPECT_NE(shifted.err.find("--offset without --period"), std::string::npos) << shifted.err;
    const json odd = json::parse(shifted.out);
    EXPECT_GE(odd["period"][0], 50);
    EXPECT_EQ(odd["period"][0].get<int>() % 2, 0);
    EXPECT_EQ(odd["size"], json::array({50, 21}));
    std::filesystem::remove_all(folder_ / "out");
    std::filesystem::create_directory(folder_ / "out");
    expect_refusal({"m.json", "-o", "out/a.png", "--period", "64"}, 2, "--period goes with --offset");
    expect_refusal({"m.json", "-o", "out/a.png", "--offset", "3"}, 2, "--offset: '3' is not X,Y");
    expect_refusal({"m.json", "-o", "out/a.png", "--offset", "3,4", "--method", "raster"}, 2, "raster");
}

TEST_F(CliSynth, QuietSaysNothing) {
    put("m.json", ModelKind::car3d, 1);
    const Ended ended = synth({"m.json", "-o", "out/a.png", "--quiet"});
    EXPECT_EQ(ended.code, 0);
    EXPECT_EQ(ended.out + ended.err, "");
    EXPECT_TRUE(std::filesystem::exists(folder_ / "out/a.png"));
    EXPECT_EQ(btfield({"-q", "info", "m.json"}, here_).out, btfield({"info", "m.json"}, here_).out);
    EXPECT_NE(synth({"m.json", "-o", "out/a.png", "-q", "--json"}).out, "");
}

TEST_F(CliSynth, NarrowStripsOfFarReachingModelsAreTold) {
    TextureModel model = test::example_model(ModelKind::car3d, 1, 1);
    CarModel car;
    car.kind = NeighbourhoodKind::custom;
    car.planes = 1;
    car.offsets = {{-1, -1}, {-1, 0}, {0, -1}};
    car.coefficients = {-0.81, 0.9, 0.9};  // correlates over some ten pixels along both axes
    car.noise_covariance = {0.001};
    model.levels.front().models = {car};
    put_model(folder_ / "m.json", model);
    const Ended strip = synth({"m.json", "-o", "out/a.exr", "--size", "128x4"});
    EXPECT_EQ(strip.code, 0) << strip.err;
    EXPECT_NE(strip.err.find("textures of 128 x 4 pixels have about"), std::string::npos) << strip.err;
    EXPECT_NE(strip.err.find("from about 32 pixels on it is right"), std::string::npos) << strip.err;
    for (const char* size : {"128x128", "8x8"})
        EXPECT_EQ(synth({"m.json", "-o", std::string("out/") + size + ".exr", "--size", size}).err, "");
}

}  // namespace
}  // namespace btfield
