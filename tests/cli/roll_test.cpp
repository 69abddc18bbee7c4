// `btfield roll` as users' scripts see it.

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "btfield/image_io.hpp"
#include "tests/cli_cases.hpp"
#include "tests/device_cases.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;

using nlohmann::json;
using test::btfield;
using test::Ended;
using test::expect_failure;
using test::expect_keys;
using test::expect_object;
using test::expect_seconds;
using test::TemporaryFolder;

const std::string data = test::data_folder();

TEST(CliRoll, Quilt) {
    const TemporaryFolder folder;
    const std::string out = (folder / "large.png").string();
    const json object = expect_object({"roll", data + "/bark.png", "-o", out, "--size", "210x170"});
    expect_keys(object,
                {"outputs", "size", "tile", "tileable", "seed", "cut_cost", "seam", "device", "seconds"});
    EXPECT_EQ(object["outputs"], json::array({out}));
    EXPECT_EQ(object["size"], json::array({210, 170}));
    EXPECT_EQ(object["tile"], false);
    EXPECT_EQ(object["tileable"], true);
    EXPECT_GT(object["cut_cost"].get<double>(), 0.0);
    EXPECT_GT(object["seam"].get<double>(), 0.0);
    expect_seconds(object, {"read", "roll", "write", "total"});
    const Picture made = read_picture(out);
    EXPECT_EQ(made.image.size(), (Size{170, 210}));
    EXPECT_EQ(made.image.planes(), 3);
    EXPECT_EQ(folder.names().size(), 1U);

    const std::string again = (folder / "again.png").string(), other = (folder / "other.png").string();
    (void)expect_object({"roll", data + "/bark.png", "-o", again, "--size", "210x170"});
    (void)expect_object({"roll", data + "/bark.png", "-o", other, "--size", "210x170", "--seed", "1"});
    EXPECT_EQ(test::bytes_of(out), test::bytes_of(again));
    EXPECT_NE(test::bytes_of(out), test::bytes_of(other));
    const Ended text = btfield({"roll", data + "/bark.png", "-o", out, "--size", "64x64", "--block", "16"});
    EXPECT_NE(text.out.find("it tiles"), std::string::npos) << text.out;
    EXPECT_NE(text.out.find("seam "), std::string::npos) << text.out;
    EXPECT_NE(text.out.find("1 where cuts do not show"), std::string::npos) << text.out;
    EXPECT_NE(text.out.find("200 % of places that have nothing in common"), std::string::npos) << text.out;
}

TEST(CliRoll, Tiles) {
    const TemporaryFolder folder;
    const std::string out = (folder / "tile.png").string();
    const json tile = expect_object({"roll", data + "/grass.png", "-o", out, "--tile"});
    EXPECT_EQ(tile["tile"], true);
    const Size size = read_picture(out).image.size();
    EXPECT_EQ(tile["size"], json::array({size.width, size.height}));
    const json tiles =
        expect_object({"roll", data + "/grass.png", "-o", out, "--tiles", "3", "--size", "50x40"});
    EXPECT_EQ(tiles["outputs"],
              json::array({(folder / "tile-0.png").string(), (folder / "tile-1.png").string(),
                           (folder / "tile-2.png").string()}));
    EXPECT_EQ(read_picture(folder / "tile-2.png").image.size(), (Size{40, 50}));
}

TEST(CliRoll, SetsStayRegisteredAndExact) {
    const TemporaryFolder folder;
    const fs::path in = folder / "in", out = folder / "out";
    fs::create_directories(in);
    fs::create_directories(out);
    const Size size{64, 80};
    Image colour = test::random_image(size, 3), height = test::random_image(size, 1), steps(size, 1);
    for (float& v : colour.values()) v = 0.5F + 0.1F * v;
    for (std::size_t i = 0; i < area(size); ++i) steps.values()[i] = static_cast<float>(i) / 65535.0F;
    height.values()[5] = -1234.567F;
    write_picture(in / "colour.png", colour);
    write_picture(in / "height.exr", height, PixelType::float32, PixelType::float32);
    write_picture(in / "steps.png", steps, PixelType::uint16);
    const json object = expect_object(
        {"roll", in.string(), "-o", out.string(), "--size", "100x90", "--cut-on", "colour,steps.png"});
    EXPECT_EQ(object["outputs"], json::array({(out / "colour.png").string(), (out / "height.exr").string(),
                                              (out / "steps.png").string()}));
    const Picture where = read_picture(out / "steps.png"), high = read_picture(out / "height.exr");
    EXPECT_EQ(where.type, PixelType::uint16);
    EXPECT_EQ(high.type, PixelType::float32);
    const Image coloured = read_picture(out / "colour.png").image,
                sample = read_picture(in / "colour.png").image;
    for (int r = 0; r < 90; ++r)
        for (int c = 0; c < 100; ++c) {
            const int at = static_cast<int>(std::lround(65535.0F * where.image.at(0, r, c)));
            ASSERT_EQ(high.image.at(0, r, c), height.values()[static_cast<std::size_t>(at)]);
            ASSERT_EQ(coloured.at(1, r, c), sample.at(1, at / 80, at % 80));
        }
}

TEST(CliRoll, TellsOfCutsThatDifferMuch) {
    const TemporaryFolder folder;
    const std::string out = (folder / "out.tif").string();
    // Fields and roads: no two patches are alike. Of bark and stones there are many.
    const test::Ended told = test::btfield({"roll", data + "/landsat.tif", "-o", out, "--tile"});
    EXPECT_EQ(told.code, 0) << told.err;
    EXPECT_NE(told.err.find("cuts may show: patches differ along them by 100 % of the variance"),
              std::string::npos)
        << told.err;
    for (const char* const picture : {"/bark.png", "/rock.png"})
        EXPECT_EQ(test::btfield({"roll", data + picture, "-o", out, "--tile"}).err, "");
    // Those of noise differ as much and do not show.
    write_picture(folder / "noise.png", test::random_image({96, 96}, 3, 0.5F));
    EXPECT_EQ(test::btfield({"roll", (folder / "noise.png").string(), "-o", out, "--tile"}).err, "");
}

TEST(CliRoll, Refusals) {
    const TemporaryFolder folder;
    const std::string bark = data + "/bark.png", out = (folder / "out.png").string();
    expect_failure({"roll", bark, "-o", out}, 2, "--tile");
    expect_failure({"roll", bark, "-o", out, "--tile", "--block", "32"}, 2, "--block");
    expect_failure({"roll", bark, data + "/grass.png", "-o", out, "--tile"}, 2, "is no folder");
    expect_failure({"roll", bark, "-o", out, "--tile", "--cut-on", "height"}, 2,
                   "'height' is none of the pictures; there are bark");
    expect_failure({"roll", bark, data + "/landsat.tif", "-o", folder.path().string(), "--tile"}, 1,
                   "pixel by pixel");
    expect_failure({"roll", bark, "-o", out, "--tile", "--size", "4000x4000"}, 1, "quilt");
    expect_failure({"roll", bark, "-o", out, "--size", "200x8"}, 2, "200x8 is smaller than 16x16");
    expect_failure({"roll", bark, "-o", out, "--size", "200x200", "--block", "9999"}, 1, "patches of 9999");
    expect_failure({"roll", folder.path().string(), "-o", out, "--tile"}, 1, "there are none");
    Image one({32, 32}, 3);
    write_picture(folder / "one.png", one);
    expect_failure({"roll", (folder / "one.png").string(), "-o", out, "--tile"}, 1, "one value everywhere");
    // Never over what is read.
    const std::string copy = (folder / "bark.png").string();
    fs::copy_file(bark, copy);
    expect_failure({"roll", copy, "-o", copy, "--tile"}, 1, "one of the pictures to be rolled");
    expect_failure({"roll", copy, "-o", folder.path().string(), "--tile"}, 1,
                   "one of the pictures to be rolled");
    EXPECT_EQ(test::bytes_of(copy), test::bytes_of(bark));
    EXPECT_EQ(folder.names(), (std::vector<std::string>{"bark.png", "one.png"}));
}

}  // namespace
}  // namespace btfield
