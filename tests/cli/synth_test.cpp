// `btfield synth` of several models, and by raster recursion: the built program in a process of its own.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "btfield/image_io.hpp"
#include "btfield/model_file.hpp"
#include "tests/example_model.hpp"
#include "tests/run_program.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::bytes_of;
using test::Ended;
using test::TemporaryFolder;
using Words = std::vector<std::string>;

class SynthCli : public testing::Test {
  protected:
    void put(const std::string& name, ModelKind kind, int planes, PixelType type = PixelType::uint8) {
        TextureModel model = test::example_model(kind, planes, 2);
        model.provenance.type = type;
        write_model(folder_ / name, model);
    }

    Ended synth(Words words) {
        words.insert(words.begin(), {BTFIELD_CLI, "synth"});
        return test::run_program(std::move(words), {.folder = folder_.path().string()});
    }

    json object(Words words) {
        words.emplace_back("--json");
        const Ended ended = synth(std::move(words));
        EXPECT_EQ(ended.code, 0) << ended.err;
        EXPECT_EQ(ended.err, "");
        json value = json::parse(ended.out, nullptr, false);
        EXPECT_TRUE(value.is_object()) << ended.out;
        return value;
    }

    /// The exit code, one line on standard error that names `part`, and nothing new in the folder `out`.
    void expect_failure(const Words& words, int code, const std::string& part) {
        const Ended ended = synth(words);
        EXPECT_EQ(ended.code, code) << ended.err;
        EXPECT_EQ(ended.out, "");
        EXPECT_EQ(ended.err.rfind("btfield: ", 0), 0U) << ended.err;
        EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
        EXPECT_NE(ended.err.find(part), std::string::npos) << "expected '" << part << "' in: " << ended.err;
        EXPECT_TRUE(std::filesystem::is_empty(folder_ / "out"));
    }

    void SetUp() override { std::filesystem::create_directory(folder_ / "out"); }

    TemporaryFolder folder_;
};

TEST_F(SynthCli, SeveralModelsAtOnce) {
    put("colour.json", ModelKind::car3d, 3);
    put("light.btfm", ModelKind::msar2d, 1, PixelType::half);
    put("bands.json", ModelKind::ma3d, 5, PixelType::uint16);
    const json all =
        object({"colour.json", "light.btfm", "bands.json", "-o", "out", "--size", "24x16", "--seed", "3"});
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
    object({"colour.json", "-o", "alone.png", "--size", "24x16", "--seed", "3"});
    EXPECT_EQ(bytes_of(folder_ / "alone.png"), bytes_of(folder_ / expected[0]));
}

TEST_F(SynthCli, FoldersTakeNumberedNames) {
    put("a.json", ModelKind::car3d, 3);
    put("b.json", ModelKind::car3d, 1);
    const json one = object({"a.json", "-o", "out", "--size", "8x8"});
    EXPECT_EQ(one["outputs"], json::array({"out/a.png"}));
    const json two = object({"a.json", "b.json", "-o", "out", "--size", "8x8", "--count", "2"});
    EXPECT_EQ(two["syntheses"][0]["outputs"], json::array({"out/a-0.png", "out/a-1.png"}));
    EXPECT_EQ(two["syntheses"][1]["outputs"], json::array({"out/b-0.png", "out/b-1.png"}));
    for (const char* name : {"a.png", "a-0.png", "a-1.png", "b-0.png", "b-1.png"})
        EXPECT_TRUE(std::filesystem::exists(folder_ / "out" / name)) << name;
}

TEST_F(SynthCli, NothingIsWrittenWhenOneModelIsBad) {
    put("good.json", ModelKind::car3d, 3);
    put("average.json", ModelKind::ma3d, 3);
    put("good.btfm", ModelKind::car3d, 3);
    const std::string whole = bytes_of(folder_ / "good.json");
    test::put_bytes(folder_ / "half.json", whole.substr(0, whole.size() / 2));
    TextureModel invalid = test::example_model(ModelKind::msar3d, 3, 2);
    invalid.levels[1].certificate.valid = false;
    write_model(folder_ / "invalid.json", invalid);

    expect_failure({"good.json", "absent.json", "-o", "out"}, 1, "absent.json");
    expect_failure({"good.json", "half.json", "-o", "out"}, 1, "half.json");
    expect_failure({"good.json", "invalid.json", "-o", "out"}, 1, "'invalid.json': ");
    expect_failure({"good.json", "average.json", "-o", "out", "--method", "raster"}, 1, "'average.json': ");
    expect_failure({"good.json", "good.btfm", "-o", "out"}, 2, "out/good.png");
    expect_failure({"good.json", "average.json", "-o", "new.png"}, 2, "no folder");
    std::filesystem::create_directory(folder_ / "out/average.png");  // in the way of the second texture
    const Ended ended = synth({"good.json", "average.json", "-o", "out"});
    EXPECT_EQ(ended.code, 1);
    EXPECT_NE(ended.err.find("average.png"), std::string::npos) << ended.err;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out/good.png"));
}

TEST_F(SynthCli, Raster) {
    put("m.json", ModelKind::car2d, 3);
    const json grown = object({"m.json", "-o", "raster.png", "--method", "raster", "--size", "32x16"});
    EXPECT_EQ(grown["tileable"], false);
    EXPECT_EQ(read_picture(folder_ / "raster.png").image.size(), (Size{16, 32}));
    object({"m.json", "-o", "torus.png", "--method", "torus", "--size", "32x16"});
    object({"m.json", "-o", "default.png", "--size", "32x16"});
    EXPECT_NE(bytes_of(folder_ / "raster.png"), bytes_of(folder_ / "torus.png"));
    EXPECT_EQ(bytes_of(folder_ / "default.png"), bytes_of(folder_ / "torus.png"));
    const Ended plain = synth({"m.json", "-o", "raster.png", "--method", "raster", "--size", "32x16"});
    EXPECT_EQ(plain.code, 0) << plain.err;
    EXPECT_NE(plain.out.find("does not tile"), std::string::npos) << plain.out;

    TextureModel growing = test::example_model(ModelKind::car3d, 1, 1);
    test::field_of(growing, 0).coefficients.assign(test::field_of(growing, 0).offsets.size(), 0.9);
    write_model(folder_ / "growing.json", growing);
    expect_failure({"growing.json", "-o", "out/t.png", "--method", "raster"}, 1, "level 0");
    expect_failure({"m.json", "-o", "out/t.png", "--method", "diagonal"}, 2, "torus|raster");
}

}  // namespace
}  // namespace btfield
