// `btfield synth --count`: parts of a batch, threads that write, compression.

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "btfield/image_io.hpp"
#include "tests/cli_cases.hpp"
#include "tests/example_model.hpp"
#include "tests/json_text.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::bytes_of;
using test::expect_failure;
using test::expect_object;
using test::put_model;
using test::Surroundings;
using test::TemporaryFolder;
using test::Words;

class CliSynthBatch : public testing::Test {
  protected:
    void SetUp() override { put_model(folder_ / "m.json"); }

    json grow(Words words) {
        words.insert(words.begin(), {"synth", "m.json"});
        return expect_object(std::move(words), here_);
    }

    TemporaryFolder folder_;
    const Surroundings here_{.folder = folder_.path().string()};
};

TEST_F(CliSynthBatch, ShardsAreTheBatch) {
    fs::create_directory(folder_ / "parts");
    const json whole = grow({"-o", "t.png", "--count", "11", "--seed", "5", "--size", "24x16"});
    EXPECT_GT(whole["textures_per_second"].get<double>(), 0.0);
    std::set<std::uint64_t> seeds;
    for (const char* shard : {"1/3", "2/3", "3/3"}) {
        const json part =
            grow({"-o", "parts/t.png", "--count", "11", "--seed", "5", "--size", "24x16", "--shard", shard});
        for (const json& seed : part["seeds"])
            EXPECT_TRUE(seeds.insert(seed.get<std::uint64_t>()).second) << seed;
    }
    EXPECT_EQ(seeds.size(), 11U);
    for (const json& output : whole["outputs"]) {
        const std::string name = output.get<std::string>();
        EXPECT_EQ(bytes_of(folder_ / name), bytes_of(folder_ / "parts" / name)) << name;
    }
}

TEST_F(CliSynthBatch, ShardsThatAreNone) {
    for (const char* shard : {"0/2", "3/2", "1", "1/", "/2", "1/0", "a/b", "1/2/3"})
        expect_failure({"synth", "m.json", "-o", "t.png", "--count", "4", "--shard", shard}, 2, "--shard",
                       here_);
    expect_failure({"synth", "m.json", "-o", "t.png", "--shard", "1/2"}, 2, "--count", here_);
    expect_failure({"synth", "m.json", "-o", "t.png", "--count", "2", "--shard", "1/3"}, 2, "2 textures",
                   here_);
}

TEST_F(CliSynthBatch, ThreadsChangeNothing) {
    grow({"-o", "many.png", "--count", "9", "--size", "40x24"});
    fs::create_directory(folder_ / "one");
    grow({"-o", "one/many.png", "--count", "9", "--size", "40x24", "--threads", "1"});
    for (int i = 0; i < 9; ++i) {
        const std::string name = "many-" + std::to_string(i) + ".png";
        EXPECT_EQ(bytes_of(folder_ / name), bytes_of(folder_ / "one" / name)) << name;
    }
}

TEST_F(CliSynthBatch, CompressionIsOfAllTextures) {
    for (const char* effort : {"0", "9"}) {
        fs::create_directory(folder_ / effort);
        grow({"-o", std::string(effort) + "/t.png", "--count", "2", "--size", "64x64", "--compression",
              effort});
    }
    for (const char* name : {"t-0.png", "t-1.png"}) {
        EXPECT_GT(fs::file_size(folder_ / "0" / name), fs::file_size(folder_ / "9" / name));
        const Image plain = read_picture(folder_ / "0" / name).image,
                    small = read_picture(folder_ / "9" / name).image;
        EXPECT_TRUE(std::ranges::equal(plain.values(), small.values())) << name;
    }
    expect_failure({"synth", "m.json", "-o", "t.png", "--compression", "10"}, 2, "--compression", here_);
    expect_failure({"synth", "m.json", "-o", "t.jpg", "--compression", "5"}, 2, "PNG, TIFF and EXR", here_);
}

TEST_F(CliSynthBatch, NamesOfTheWholeBatchAreLookedAtFirst) {
    fs::create_directories(folder_ / "t-2.png");
    expect_failure({"synth", "m.json", "-o", "t.png", "--count", "3", "--size", "16x16"}, 1, "t-2.png",
                   here_);
    EXPECT_FALSE(fs::exists(folder_ / "t-0.png"));
}

}  // namespace
}  // namespace btfield
