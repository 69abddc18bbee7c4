// What `--help` says of every command, and whether its examples do what they say.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "btfield/height.hpp"
#include "btfield/image_io.hpp"
#include "tests/cli_cases.hpp"
#include "tests/light_cases.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using test::btfield;
using test::commands;
using test::Ended;
using test::Surroundings;
using test::TemporaryFolder;
using test::text_of;
using test::Words;

const std::string data = test::data_folder();

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
}

std::vector<std::string> help_of(Words words) {
    words.emplace_back("--help");
    const Ended ended = btfield(words);
    EXPECT_EQ(ended.code, 0) << text_of(words);
    EXPECT_EQ(ended.err, "");
    return lines_of(ended.out);
}

/// The lines to paste below a title, without the comments behind them.
std::vector<std::string> examples(const std::vector<std::string>& help, std::size_t title) {
    std::vector<std::string> found;
    for (std::size_t i = title + 1; i < help.size() && help[i].rfind("  ", 0) == 0; ++i) {
        const std::string line = help[i].substr(2, help[i].find(" #") - 2);
        if (line[0] != ' ') found.push_back(line);
    }
    return found;
}

/// What the examples name, as small as can be.
class CliHelp : public testing::Test {
  protected:
    void SetUp() override {
        for (const char* name : {"cork.png", "cork-4x.png"}) put(name, "/cork.png");
        for (const char* name : {"bark.png", "bark.tif", "sand.png", "moss.png"}) put(name, "/bark.png");
        for (const char* name : {"material.exr", "grown.exr"}) put(name, "/cork-xyz.exr");
        Image normals({48, 48}, 3);
        for (int p = 0; p < 3; ++p) std::ranges::fill(normals.plane(p), p == 2 ? 1.0F : 0.5F);
        write_picture(folder_ / "normal.png", normals, PixelType::uint16);
        put_material();
        test::put_lights(folder_ / "stack", {24, 24}, 6, 1, PixelType::uint8, ".png");
        for (const char* name : {"models", "textures", "tiles", "best"}) fs::create_directory(folder_ / name);
        test::put_bytes(folder_ / "sand.json", R"({"pictures": [{"material": "sand", "files": ["sand.png"]}],
            "models": ["2d-car"], "orders": [1], "levels": [1], "seeds": [1, 2]})");
        for (const char* shard : {"1", "2"}) {
            const Ended ended =
                btfield({"experiment", "run", "sand.json", "--out", std::string("sand-") + shard + ".db",
                         "--shard", shard + std::string("/2")},
                        here_);
            ASSERT_EQ(ended.code, 0) << ended.err;
        }
        fs::create_symlink(test::command_path(), folder_ / "btfield");
    }

    void put(const char* name, const char* picture) {
        const Picture whole = read_picture(data + picture, Crop{0, 0, 48, 48});
        write_picture(folder_ / name, whole.image, whole.type);
    }

    /// Maps of a small rock, and a BTF of two pictures.
    void put_material() {
        Image height({8, 8}, 1);
        for (int r = 0; r < 8; ++r)
            for (int c = 0; c < 8; ++c) height.at(0, r, c) = static_cast<float>((c % 4) * (r % 4)) / 4.0F;
        write_picture(folder_ / "rock-height.png", encode_height(height, 8.0), PixelType::uint16);
        write_picture(folder_ / "rock-normal.png",
                      encode_normals(normals_of_slopes(slopes_of_height(height, SurfaceEdges::periodic))),
                      PixelType::uint16);
        const Image colour = read_picture(data + "/rock.png", Crop{0, 0, 8, 8}).image;
        write_picture(folder_ / "rock-albedo.png", colour, PixelType::uint8);
        fs::create_directory(folder_ / "set");
        for (const char* name : {"tl000_pl000_tv000_pv000.png", "tl045_pl020_tv000_pv000.png"})
            write_picture(folder_ / "set" / name, colour, PixelType::uint8);
    }

    /// As a shell in the folder runs it, the command being the one that was built.
    Ended run(const std::string& line) {
        return test::run_program({"/bin/sh", "-c", "PATH=.:$PATH; " + line}, here_);
    }

    TemporaryFolder folder_;
    const Surroundings here_{.folder = folder_.path().string()};
};

TEST_F(CliHelp, FitsALine) {
    for (const Words& words : commands()) {
        SCOPED_TRACE(text_of(words));
        const std::vector<std::string> help = help_of(words);
        for (const std::string& line : help) EXPECT_LE(line.size(), 80U) << line;
        Words asked = words;
        asked.insert(asked.begin(), "help");
        EXPECT_EQ(lines_of(btfield(asked).out), help);
    }
}

TEST_F(CliHelp, BeginsWithTheUsualCaseWhichWorks) {
    for (const Words& words : commands()) {
        SCOPED_TRACE(text_of(words));
        const std::vector<std::string> help = help_of(words);
        ASSERT_GE(help.size(), 4U);
        EXPECT_EQ(help[0].back(), ':') << help[0];
        const std::vector<std::string> usual = examples(help, 0);
        ASSERT_FALSE(usual.empty());
        EXPECT_EQ((usual[0] + " ").rfind(text_of(words) + " ", 0), 0U) << usual[0];
        for (const std::string& line : usual) {
            if (words == Words{"experiment", "merge"})
                fs::remove(folder_ / "sand.db");  // merges into new files only
            const Ended ended = run(line);
            EXPECT_EQ(ended.code, 0) << line << "\n" << ended.err;
        }
    }
}

using CliHelpLong = CliHelp;

TEST_F(CliHelpLong, OtherExamplesAreUnderstood) {
    std::size_t count = 0;
    for (const Words& words : commands()) {
        SCOPED_TRACE(text_of(words));
        const std::vector<std::string> help = help_of(words);
        const auto title = std::find(help.begin(), help.end(), "More examples:");
        if (title == help.end()) continue;
        for (std::string line : examples(help, static_cast<std::size_t>(title - help.begin()))) {
            if (line.rfind("mpirun", 0) == 0) line = line.substr(line.find("btfield"));
            const Ended ended = run(line);
            // Done, or, as for want of a GPU or of a second shard, refused; but never wrong usage.
            EXPECT_TRUE(ended.code == 0 || ended.code == 1 || ended.code == 3) << line << "\n" << ended.err;
            ++count;
        }
    }
    EXPECT_GE(count, 10U);
}

TEST(CliHelpText, FitsAPageAndHasGroups) {
    for (const Words& words : commands()) {
        SCOPED_TRACE(text_of(words));
        const std::vector<std::string> help = help_of(words);
        for (const std::string& line : help) {
            const bool whole =
                line.rfind("  -", 0) == 0 || line.rfind("  btfield ", 0) == 0;  // cannot be broken
            EXPECT_TRUE(whole || line.size() <= 80) << line;
        }
        EXPECT_EQ(
            std::count_if(help.begin(), help.end(), [](const auto& l) { return l.rfind("Usage: ", 0) == 0; }),
            1);
        EXPECT_EQ(help.back().empty(), false);
    }
    const std::vector<std::string> fit = help_of({"fit"});
    const auto at = [&](const std::string& line) { return std::find(fit.begin(), fit.end(), line); };
    EXPECT_LT(at("Options:"), at("Neighbourhood and pyramid:"));
    EXPECT_LT(at("Neighbourhood and pyramid:"), at("General:"));
    EXPECT_LT(at("General:"), at("More examples:"));
    EXPECT_LT(at("More examples:"), fit.end());
}

}  // namespace
}  // namespace btfield
