// btfield fit --joint and synth of its models, as users' scripts see them.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "btfield/height.hpp"
#include "btfield/image_io.hpp"
#include "tests/cli_cases.hpp"
#include "tests/json_text.hpp"
#include "tests/material_cases.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::btfield;
using test::Ended;
using test::Words;

class CliMaterial : public testing::Test {
  protected:
    void SetUp() override { test::put_material(folder_.path()); }
    Ended run(const Words& words) { return btfield(words, {.folder = folder_.path().string()}); }
    json object(const Words& words) {
        return test::expect_object(words, {.folder = folder_.path().string()});
    }
    const Words maps_{"s_albedo.png", "s_normal.png", "s_height.png"};
    test::TemporaryFolder folder_;
};

TEST_F(CliMaterial, MapsComeBackRegisteredUnderTheirNames) {
    const json fitted = object({"fit", maps_[0], maps_[1], maps_[2], "--joint", "-o", "s.json"});
    ASSERT_EQ(fitted["maps"].size(), 3U);
    EXPECT_EQ(fitted["maps"][0],
              json({{"name", "s_albedo.png"}, {"role", "colour"}, {"planes", 3}, {"type", "uint16"}}));
    EXPECT_EQ(fitted["maps"][1]["planes"], 0);
    EXPECT_EQ(fitted["maps"][2]["role"], "height");
    EXPECT_NEAR(fitted["maps"][2]["scale"].get<double>(), 12.0, 6.0);  // of values about ±4
    EXPECT_EQ(fitted["planes"], 4);
    const json grown = object({"synth", "s.json", "-o", "out", "--size", "64x96"});
    EXPECT_EQ(grown["outputs"], json({"out/s_albedo.png", "out/s_normal.png", "out/s_height.png"}));
    const json side = test::parsed(test::bytes_of(folder_ / "out/material.json"));
    EXPECT_EQ(side["size"], json({64, 96}));
    EXPECT_EQ(side["maps"][1]["convention"], "opengl");
    const double scale = side["maps"][2]["scale"].get<double>();
    Image height = read_picture(folder_ / "out/s_height.png").image;
    for (float& v : height.values()) v = static_cast<float>((static_cast<double>(v) - mid_grey) * scale);
    ReadOptions raw;
    raw.keep_values = true;
    const Image written = decode_normals(read_picture(folder_ / "out/s_normal.png", raw));
    const Image told = normals_of_slopes(slopes_of_height(height, SurfaceEdges::periodic));
    for (std::size_t i = 0; i < told.values().size(); ++i)
        ASSERT_NEAR(written.values()[i], told.values()[i], 2e-3);
    // The other way up, several, and windows of a plane.
    object({"synth", "s.json", "-o", "dx", "--size", "64", "--convention", "directx", "--count", "2"});
    object({"synth", "s.json", "-o", "gl", "--size", "64"});
    const Image down = read_picture(folder_ / "dx/s_normal-0.png", raw).image;
    const Image up = read_picture(folder_ / "gl/s_normal.png", raw).image;
    for (std::size_t i = 0; i < up.plane(1).size(); ++i)
        ASSERT_NEAR(down.plane(1)[i], 1.0F - up.plane(1)[i], 2.0F / 65535.0F);
    object({"synth", "s.json", "-o", "win", "--size", "16", "--offset", "56,8", "--period", "64"});
    const Image window = read_picture(folder_ / "win/s_normal.png", raw).image;
    const Image expected = up.window(8, 56, {16, 16});
    for (std::size_t i = 0; i < window.values().size(); ++i)
        ASSERT_NEAR(window.values()[i], expected.values()[i], 2.0F / 65535.0F);
}

TEST_F(CliMaterial, MapsThatAreFittedApartAreToldOf) {
    const Words quick{"--levels", "1", "--order", "1"};
    Words words{"fit", maps_[0], maps_[1], maps_[2], "-o", "models/"};
    words.insert(words.end(), quick.begin(), quick.end());
    const test::Ended apart = run(words);
    EXPECT_EQ(apart.code, 0) << apart.err;
    EXPECT_NE(apart.err.find("--joint"), std::string::npos) << apart.err;
    const test::Surroundings here{.folder = folder_.path().string()};
    test::expect_failure({"fit", maps_[0], maps_[1], maps_[2], "-o", "m.json"}, 2,
                         "need; these look like maps of one material: --joint makes one model", here);
    test::expect_failure({"compound", "fit", maps_[0], maps_[2], "-o", "m.json"}, 2,
                         "need; these look like maps of one material: --joint makes one model", here);
    test::expect_failure({"fit", "a.png", "b.png", "-o", "m.json"}, 2, "give a folder, such as models/, or",
                         here);
    test::expect_failure({"fit", ".", "-o", "m.json"}, 1, "--joint -o MODEL",
                         {.folder = folder_.path().string()});
    test::expect_failure({"compound", "fit", "models", "-o", "m.json"}, 1, "it is a folder;",
                         {.folder = folder_.path().string()});
    EXPECT_EQ(run({"fit", maps_[0], "-o", "m.json", "--levels", "1", "--order", "1"}).err.find("--joint"),
              std::string::npos);
}

TEST_F(CliMaterial, TypesAndPlanesAreTold) {
    test::put_scalar_maps(folder_.path());
    const Words quick{"--joint", "--levels", "1", "--order", "1", "-o", "m.json"};
    const auto told = [&](Words words) {
        words.insert(words.end(), quick.begin(), quick.end());
        const Ended ended = run(words);
        EXPECT_EQ(ended.code, 0) << ended.err;
        EXPECT_EQ(run({"info", "m.json"}).code, 0);
        return ended.out;
    };
    const std::string mixed = told({"fit", maps_[0], maps_[1], "s_roughness.png", "s_ao.png"});
    EXPECT_NE(mixed.find("6 planes of uint16, uint8 of s_roughness.png, uint8 of s_ao.png, srgb in planes"),
              std::string::npos)
        << mixed;
    EXPECT_NE(told({"fit", maps_[0], maps_[2]}).find("4 planes of uint16, srgb"), std::string::npos);
}

TEST_F(CliMaterial, StructureOfEachMapIsTold) {
    // Rings in the colours, noise in the normals.
    Image colour({64, 64}, 3, ColourSpace::srgb);
    for (int p = 0; p < 3; ++p)
        for (int r = 0; r < 64; ++r)
            for (int c = 0; c < 64; ++c)
                colour.at(p, r, c) =
                    std::hypot(r % 16 - 8, c % 16 - 8) < 6.0 ? 0.8F : 0.2F + 0.1F * static_cast<float>(p);
    test::put_map(folder_ / "s_albedo.png", colour, PixelType::uint8);
    const Ended field = run({"fit", maps_[0], maps_[1], "--joint", "-o", "m.json"});
    const auto distance = [&](const std::string& text, const std::string& of) {
        const std::size_t at = text.find(of);
        return at == std::string::npos ? -1.0 : std::stod(text.substr(at + of.size()));
    };
    const double all = distance(field.out, "It loses shapes: structure distance "),
                 colours = distance(field.out, ", of s_albedo.png alone "),
                 normals = distance(field.out, ", of s_normal.png alone ");
    EXPECT_GT(colours, 0.07) << field.out << field.err;
    EXPECT_GT(normals, 0.0) << field.out;
    EXPECT_LT(normals, 0.7 * colours);
    EXPECT_GT(all, 0.07);
    EXPECT_NE(
        field.out.find("fit --joint' of the same maps keeps more of those in colour, of others it may not"),
        std::string::npos)
        << field.out;
    const Ended regions =
        run({"compound", "fit", maps_[0], maps_[1], "--joint", "-o", "c.json", "--regions", "2"});
    EXPECT_GT(distance(regions.out, ", of s_albedo.png alone "), 0.0) << regions.out;
}

TEST_F(CliMaterial, MapsThatFlatteningTakesOutAreTold) {
    test::put_scalar_maps(folder_.path());
    Image slope({64, 64}, 1), bowl({64, 64}, 1), level({64, 64}, 1);
    for (int r = 0; r < 64; ++r)
        for (int c = 0; c < 64; ++c) {
            slope.at(0, r, c) = 0.2F + 0.01F * static_cast<float>(c);
            bowl.at(0, r, c) = 0.2F + 0.0001F * static_cast<float>(r * r + c * c);
            level.at(0, r, c) = 0.5F;
        }
    test::put_map(folder_ / "slope_height.png", slope, PixelType::uint8);
    test::put_map(folder_ / "bowl_height.png", bowl, PixelType::uint16);
    test::put_map(folder_ / "level_height.png", level, PixelType::uint8);
    const auto told = [&](const std::string& height, const std::string& how) {
        const Ended ended = run({"fit", height, "s_roughness.png", "--joint", "--roles", "height,roughness",
                                 "-o", "m.json", "--levels", "1", "--order", "1", "--flatten", how});
        EXPECT_EQ(ended.code, 0) << ended.err;
        return ended.err;
    };
    EXPECT_NE(told("slope_height.png", "plane").find("--flatten plane leaves 0.00"),
              std::string::npos);  // of 8 bits
    EXPECT_NE(told("bowl_height.png", "low").find("--flatten low leaves nothing of bowl_height"),
              std::string::npos);
    EXPECT_EQ(told("bowl_height.png", "plane").find("leaves"), std::string::npos);
    EXPECT_EQ(told("level_height.png", "plane").find("leaves"), std::string::npos);
    test::expect_failure({"fit", "bowl_height.png", "-o", "n.json", "--flatten", "low"}, 1,
                         "'bowl_height.png': it is nothing but a slope and a bowl;",
                         {.folder = folder_.path().string()});
}

TEST_F(CliMaterial, CompoundModelsToo) {
    const json fitted = object(
        {"compound", "fit", maps_[0], maps_[1], maps_[2], "--joint", "-o", "s.btfm", "--regions", "2"});
    EXPECT_EQ(fitted["maps"].size(), 3U);
    EXPECT_EQ(object({"info", "s.btfm"})["maps"], fitted["maps"]);
    EXPECT_EQ(object({"synth", "s.btfm", "-o", "out/"})["outputs"].size(), 3U);
    EXPECT_EQ(read_picture(folder_ / "out/s_height.png").type, PixelType::uint16);
    const std::string table = run({"info", "s.btfm"}).out;
    EXPECT_NE(table.find("certificate  means of s_albedo.R, s_albedo.G, s_albedo.B, s_height\n"),
              std::string::npos)
        << table;
}

TEST_F(CliMaterial, WrongUsageAndSourcesThatStay) {
    EXPECT_EQ(run({"fit", maps_[0], "-o", "s.json", "--roles", "colour"}).code, 2);
    EXPECT_EQ(run({"fit", maps_[0], maps_[1], "--joint", "-o", "s.json", "--roles", "colour"}).code, 2);
    EXPECT_EQ(run({"fit", maps_[0], maps_[1], "--joint", "-o", "s.json", "--roles", "colour,shine"}).code, 2);
    test::expect_failure({"fit", maps_[0], maps_[2], "--joint", "-o", "s.json", "--convention", "directx"}, 2,
                         "--convention: none of the maps is a normal map",
                         {.folder = folder_.path().string()});
    // Colours are no normals, normals are.
    const Words quick{"--joint", "--levels", "1", "--order", "1", "-o", "w.json"};
    const auto told = [&](Words words) {
        words.insert(words.end(), quick.begin(), quick.end());
        return run(words).err;
    };
    EXPECT_NE(told({"fit", maps_[0], "--roles", "normal"}).find("does not look like a normal map"),
              std::string::npos);
    EXPECT_EQ(told({"fit", maps_[1]}).find("normal map"), std::string::npos);
    const Ended twice =
        run({"fit", maps_[1], maps_[2], "--joint", "-o", "s.json", "--roles", "height,height"});
    EXPECT_EQ(twice.code, 1);
    ASSERT_EQ(run({"fit", maps_[0], maps_[1], maps_[2], "--joint", "-o", "s.json"}).code, 0);
    // Into their own folder they would replace what they were learned from.
    const std::string before = test::bytes_of(folder_ / maps_[1]);
    const Ended here = run({"synth", "s.json", "-o", "."});
    EXPECT_EQ(here.code, 1) << here.err;
    EXPECT_NE(here.err.find("--overwrite"), std::string::npos) << here.err;
    EXPECT_EQ(test::bytes_of(folder_ / maps_[1]), before);
    EXPECT_EQ(run({"synth", "s.json", "-o", "t.png"}).code, 2);
}

}  // namespace
}  // namespace btfield
