#include "btfield/light_set.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "btfield/error.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using test::put_bytes;
using test::TemporaryFolder;

class LightSets : public testing::Test {
  protected:
    /// Files that stand for pictures: none is opened.
    void pictures(const std::vector<std::string>& names) {
        for (const std::string& name : names) {
            fs::create_directories((folder_ / name).parent_path());
            put_bytes(folder_ / name, "picture");
        }
    }
    void table(const std::string& text) { put_bytes(folder_ / "dirs.lp", text); }
    [[nodiscard]] LightSet read(const LightSetOptions& options = {}) const {
        return read_light_set(folder_ / "dirs.lp", options);
    }
    void refused(const fs::path& lights, const std::string& part) const {
        try {
            static_cast<void>(read_light_set(lights));
            ADD_FAILURE() << "accepted";
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
        }
    }
    void refused_table(const std::string& text, const std::string& part) {
        table(text);
        refused(folder_ / "dirs.lp", part);
    }

    TemporaryFolder folder_;
};

TEST_F(LightSets, LpFiles) {
    pictures({"a b.png", "deep/c.png", "D.JPG"});
    table(
        "\xef\xbb\xbf"
        "3  \r\na b.png 0 0 2\r\n\r\nC:\\photos\\set\\deep\\c.png +0.5 0 .5\r\n d.jpg\t0 -3 4 \r\n");
    pictures({"c.png"});
    const LightSet set = read();
    EXPECT_EQ(set.layout, "lp");
    ASSERT_EQ(set.lights.size(), 3U);
    EXPECT_EQ(set.lights[0].picture, folder_ / "a b.png");
    EXPECT_EQ(set.lights[1].picture, folder_ / "c.png");
    EXPECT_EQ(set.lights[2].picture, folder_ / "D.JPG");
    EXPECT_EQ(set.lights[0].direction, (std::array{0.0, 0.0, 1.0}));
    EXPECT_DOUBLE_EQ(set.lights[1].direction[0], std::sqrt(0.5));
    EXPECT_DOUBLE_EQ(set.lights[2].direction[1], -0.6);
    EXPECT_TRUE(set.mask.empty());
    // A path with back-slashes that leads somewhere.
    table("3\na b.png 0 0 2\ndeep\\c.png 1 0 1\nd.jpg 0 -3 4\n");
    EXPECT_EQ(read().lights[1].picture, folder_ / "deep/c.png");
    // A folder with one such file.
    EXPECT_EQ(read_light_set(folder_.path()).lights.size(), 3U);
}

TEST_F(LightSets, LpFilesThatAreWrong) {
    pictures({"1.png", "2.png", "3.png", "4.png"});
    const std::string three = "1.png 1 0 1\n2.png 0 1 1\n3.png 0 0 1\n";
    refused_table("", "no number of lights");
    refused_table(three, "line 1: '1.png 1 0 1' is no number of lights");
    refused_table("4\n" + three, "it says 4 lights and has 3");
    refused_table("4\n" + three + "4.png 0 1 x\n", "line 5: 'x' is no number");
    refused_table("4\n" + three + "1 1\n", "line 5");
    refused_table("4\n" + three + "4.png 0 0 0\n", "line 5: the direction has no length");
    refused_table("4\n" + three + "4.png 1 0 nan\n", "line 5");
    refused_table("4\n" + three + "5.png 1 1 1\n", "line 5: there is no picture '5.png'");
    refused_table("4\n" + three + "2.png 1 1 1\n", "line 5: '2.png' stands on line 3 too");
    refused_table("4\n" + three + "4.png 1 1 -0.1\n", "line 5: the light of '4.png' is behind the surface");
    refused_table("4\n" + three + "4.png 1 1 0\n", "behind the surface");
    refused_table("2\n1.png 1 0 1\n2.png 0 1 1\n", "2 lights");
    refused_table("4\n1.png 1 0 1\n2.png 0 0 1\n3.png -1 0 1\n4.png -2 0 1\n", "one plane");
    refused(folder_ / "absent.lp", "no such file");
    LightSetOptions options;
    options.leave_out_behind = true;
    table("4\n" + three + "4.png 1 1 -0.1\n");
    const LightSet set = read(options);
    EXPECT_EQ(set.lights.size(), 3U);
    ASSERT_EQ(set.remarks.size(), 1U);
    EXPECT_NE(set.remarks[0].find("4.png"), std::string::npos);
}

TEST_F(LightSets, Diligent) {
    pictures({"001.png", "002.png", "003.png", "mask.png"});
    put_bytes(folder_ / "filenames.txt", "001.png\n002.png\n003.png\n");
    put_bytes(folder_ / "light_directions.txt", "1 0 1\n0 1 1\n0 0 1\n");
    put_bytes(folder_ / "light_intensities.txt", "1 2 4\n2 2 2\n3 1 1\n");
    const LightSet set = read_light_set(folder_.path());
    EXPECT_EQ(set.layout, "diligent");
    EXPECT_EQ(set.mask, folder_ / "mask.png");
    ASSERT_EQ(set.lights.size(), 3U);
    EXPECT_EQ(set.lights[2].picture, folder_ / "003.png");
    EXPECT_EQ(set.lights[0].intensity, (std::vector{1.0, 2.0, 4.0}));
    EXPECT_EQ(set.lights[2].intensity, (std::vector{3.0, 1.0, 1.0}));
    // A .lp file there has its intensities, line by line, and its mask.
    pictures({"004.png"});
    put_bytes(folder_ / "filenames.txt", "001.png\n002.png\n003.png\n004.png\n");
    put_bytes(folder_ / "light_directions.txt", "1 0 1\n0 1 1\n0 0 1\n1 1 1\n");
    table("4\n001.png 1 0 1\n002.png 0 1 -1\n003.png 0 0 1\n004.png 0 1 1\n");
    put_bytes(folder_ / "light_intensities.txt", "1\n2\n3\n4\n");
    LightSetOptions options;
    options.leave_out_behind = true;
    const LightSet lp = read(options);
    EXPECT_EQ(lp.layout, "lp");
    EXPECT_EQ(lp.mask, folder_ / "mask.png");
    ASSERT_EQ(lp.lights.size(), 3U);
    EXPECT_EQ(lp.lights[1].intensity, std::vector{3.0});

    table("4\n001.png 1 0 1\n002.png 0 1 1\n003.png 0 0 1\n004.png 1 1 1\n");
    put_bytes(folder_ / "light_intensities.txt", "1\n2\n3\n");
    refused(folder_ / "dirs.lp", "3 lines for 4 lights");
    put_bytes(folder_ / "light_intensities.txt", "1\n2\n0\n4\n");
    refused(folder_ / "dirs.lp", "line 3: an intensity is not above 0");
    fs::remove(folder_ / "dirs.lp");
    put_bytes(folder_ / "filenames.txt", "001.png\n002.png\n");
    refused(folder_.path(), "2 names and light_directions.txt 4 lines");
}

TEST_F(LightSets, Tables) {
    pictures({"image2.png", "image10.png", "image1.png", "notes.doc"});
    put_bytes(folder_ / "lights.txt", "3\n1 0 1\n0 1 1\n0 0 1\n");
    const LightSet set = read_light_set(folder_.path());
    EXPECT_EQ(set.layout, "table");
    ASSERT_EQ(set.lights.size(), 3U);
    EXPECT_EQ(set.lights[1].picture, folder_ / "image2.png");
    EXPECT_EQ(set.lights[2].picture, folder_ / "image10.png");
    put_bytes(folder_ / "lights.txt", "1 0 1\n0 1 1\n");
    refused(folder_.path(), "2 lines for 3 pictures");
    put_bytes(folder_ / "lights.txt", "4\n1 0 1\n0 1 1\n0 0 1\n");
    refused(folder_.path(), "it says 4 lights and has 3");
    put_bytes(folder_ / "directions.csv",
              "# name, x, y, z\nimage10.png, 1, 0, 1\nimage1.png, 0, 1, 1\nimage2.png, 0, 0, 1\n");
    const LightSet named = read_light_set(folder_.path());
    EXPECT_EQ(named.lights[0].picture, folder_ / "image10.png");
    EXPECT_DOUBLE_EQ(named.lights[1].direction[1], std::sqrt(0.5));
}

TEST_F(LightSets, TheViewFromAboveOfABtf) {
    pictures(
        {"tv000_pv000/00000 tl000 pl000 tv000 pv000.jpg", "tv000_pv000/00001 tl015 pl000 tv000 pv000.jpg",
         "tv000_pv000/00002 tl030 pl090 tv000 pv000.jpg", "tv015_pv000/00003 tl000 pl000 tv015 pv000.jpg"});
    const LightSet set = read_light_set(folder_.path());
    EXPECT_EQ(set.layout, "btf");
    ASSERT_EQ(set.lights.size(), 3U);
    EXPECT_NEAR(set.lights[1].direction[0], std::sin(std::acos(-1.0) / 12.0), 1e-12);
    EXPECT_NEAR(set.lights[2].direction[1], 0.5, 1e-12);
    EXPECT_NEAR(set.lights[2].direction[0], 0.0, 1e-12);
    pictures({"again/tl030_pl090_tv000_pv000.png"});
    refused(folder_.path(), "same directions");
}

TEST_F(LightSets, OtherFolders) {
    refused(folder_.path(), "neither a .lp file");
    pictures({"1.png"});
    put_bytes(folder_ / "a.lp", "1\n1.png 0 0 1\n");
    put_bytes(folder_ / "b.lp", "1\n1.png 0 0 1\n");
    refused(folder_.path(), "2 .lp files");
}

}  // namespace
}  // namespace btfield
