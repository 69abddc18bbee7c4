// `btfield memd` as users' scripts see it.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "btfield/image_io.hpp"
#include "btfield/memd.hpp"
#include "tests/cli_cases.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::btfield;
using test::Ended;
using test::expect_failure;
using test::expect_object;
using test::TemporaryFolder;

const std::string data = test::data_folder();

/// Grey pixels of the given values, 0…255, in one row.
void put_row(const std::filesystem::path& path, const std::vector<int>& values) {
    Image image({1, static_cast<int>(values.size())}, 1);
    for (std::size_t i = 0; i < values.size(); ++i)
        image.values()[i] = static_cast<float>(values[i]) / 255.0F;
    write_picture(path, image);
}

TEST(CliMemd, TwoPixels) {
    const TemporaryFolder folder;
    const std::string a = (folder / "a.png").string(), b = (folder / "b.png").string();
    put_row(a, {10, 11});
    put_row(b, {11, 8, 200});
    const json object = expect_object({"memd", a, b});
    EXPECT_EQ(object["memd"], 2.0);
    EXPECT_EQ(object["memd_star"].get<double>(), 100.0 * 2.0 / 255.0);
    EXPECT_EQ(object["metric"], "max");
    EXPECT_EQ(object["pixels"], json::array({2, 3}));
    EXPECT_GE(object["seconds"]["search"].get<double>(), 0.0);
    EXPECT_GE(object["seconds"]["total"].get<double>(), object["seconds"]["search"].get<double>());
    EXPECT_FALSE(object.contains("reverse"));
    // 11 takes 11, 8 takes 10, and 200 finds nothing left.
    EXPECT_EQ(expect_object({"memd", a, b, "--both"})["reverse"]["memd"], 1.0);
    const Ended text = btfield({"memd", a, b});
    EXPECT_NE(text.out.find("MEMD(A, B) = 2 "), std::string::npos) << text.out;
}

TEST(CliMemd, MapsLocalErrors) {
    const TemporaryFolder folder;
    const std::string a = (folder / "a.png").string(), b = (folder / "b.png").string();
    put_row(a, {10, 11, 12});
    put_row(b, {11, 8});
    const std::string values = (folder / "map.exr").string(), colours = (folder / "map.png").string();
    EXPECT_EQ(expect_object({"memd", a, b, "--map", values})["map"], values);
    const Image map = read_picture(values).image;
    ASSERT_EQ(map.size(), (Size{1, 3}));
    EXPECT_EQ(map.at(0, 0, 0), 1.0F);
    EXPECT_EQ(map.at(0, 0, 1), 3.0F);
    EXPECT_EQ(map.at(0, 0, 2), -1.0F);
    const std::string halves = (folder / "half.exr").string();
    EXPECT_EQ(btfield({"memd", a, b, "--map", halves, "--type", "half"}).code, 0);
    EXPECT_EQ(read_picture(halves).type, PixelType::half);
    EXPECT_EQ(read_picture(halves).image.at(0, 0, 1), 3.0F);
    expect_failure({"memd", a, b, "--map", (folder / "x.tif").string(), "--type", "uint16"}, 1,
                   "half or float");
    expect_failure({"memd", a, b, "--map", (folder / "x.png").string(), "--type", "float"}, 1, "x.png");
    expect_failure({"memd", a, b, "--type", "half"}, 2, "--map");
    EXPECT_FALSE(std::filesystem::exists(folder / "x.tif"));
    EXPECT_EQ(btfield({"memd", a, b, "--map", colours}).code, 0);
    const Image shown = read_picture(colours).image;
    ASSERT_EQ(shown.planes(), 3);
    EXPECT_EQ(shown.at(0, 0, 2), 1.0F);
    EXPECT_EQ(shown.at(1, 0, 2), 0.0F);
    EXPECT_EQ(shown.at(2, 0, 2), 1.0F);
    EXPECT_GT(shown.at(1, 0, 1), shown.at(1, 0, 0));  // a larger error is lighter
}

TEST(CliMemd, HdrPictures) {
    const std::string xyz = data + "/cork-xyz.exr";
    const Ended unlike =
        btfield({"memd", xyz, data + "/cork.png", "--white", "2", "--metric", "l2", "--json"});
    EXPECT_NE(unlike.err.find("numbers are compared as they are"), std::string::npos) << unlike.err;
    ASSERT_EQ(unlike.code, 0);
    const json one = json::parse(unlike.out);
    EXPECT_EQ(one["white"], json::array({2.0, 1.0}));
    EXPECT_EQ(one["metric"], "l2");
    EXPECT_NEAR(one["largest"].get<double>(), 255.0 * std::sqrt(3.0), 1e-9);
    EXPECT_NEAR(one["memd_star"].get<double>(),
                100.0 * one["memd"].get<double>() / one["largest"].get<double>(), 1e-9);
    EXPECT_NE(btfield({"memd", xyz, xyz, "--metric", "l2"}).out.find(" of 441.7"), std::string::npos);
    const Ended text = btfield({"memd", xyz, xyz});
    EXPECT_NE(text.out.find("white level 1 in A, 1 in B (--white"), std::string::npos) << text.out;
}

TEST(CliMemd, WrongUsageAndRefusals) {
    const std::string cork = data + "/cork.png";
    expect_failure({"memd", cork}, 2, "memd");
    expect_failure({"memd", cork, cork, "--metric", "L2"}, 2, "max|l1|l2");
    expect_failure({"memd", cork, data + "/landsat.tif"}, 1, "planes");
    expect_failure({"memd", cork, cork, "--device", "abacus"}, 3, "abacus");
    const TemporaryFolder folder;
    expect_failure({"memd", cork, cork, "--map", (folder / "no" / "map.png").string()}, 1, "map.png");
    expect_failure({"memd", cork, cork, "--map", (folder / "map.xyz").string()}, 1, "map.xyz");
    EXPECT_TRUE(folder.names().empty());
}

}  // namespace
}  // namespace btfield
