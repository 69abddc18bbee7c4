// `btfield compound`, and `synth` and `info` of its models, as users' scripts see them.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "btfield/compound.hpp"
#include "btfield/image_io.hpp"
#include "tests/cli_cases.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::btfield;
using test::Ended;
using test::expect_failure;
using test::expect_keys;
using test::expect_object;
using test::expect_seconds;
using test::TemporaryFolder;

const std::string data = test::data_folder();

class CliCompound : public testing::Test {
  protected:
    TemporaryFolder folder_;
    [[nodiscard]] std::string at(const std::string& name) const { return (folder_ / name).string(); }
    /// A small model of the picture, with these words behind.
    json fitted(const std::string& name, test::Words more = {},
                const std::string& picture = "/bark.png") const {
        test::Words words{"compound", "fit",       data + picture, "-o", at(name),
                          "--crop",   "0,0,96,80", "--regions",    "4"};
        words.insert(words.end(), more.begin(), more.end());
        return expect_object(words);
    }
};

TEST_F(CliCompound, FitInfoSynth) {
    const json object = fitted("bark.btfm", {"--save-labels", at("labels.png")});
    expect_keys(object,
                {"model", "output", "source", "planes", "size", "colour_space", "borders", "explained",
                 "control", "regions", "parameters", "bytes", "compression_ratio", "reasons", "seconds"});
    EXPECT_EQ(object["model"], "compound");
    EXPECT_EQ(object["regions"].size(), 4U);
    double share = 0.0;
    for (const json& region : object["regions"]) {
        expect_keys(region, {"share", "pixels", "model", "certificate", "colour", "contrast", "levels"});
        EXPECT_EQ(region["model"], "3d-ma");
        EXPECT_EQ(region["certificate"]["valid"], true);
        share += region["share"].get<double>();
    }
    EXPECT_NEAR(share, 1.0, 1e-9);
    EXPECT_EQ(object["bytes"].get<std::uintmax_t>(), std::filesystem::file_size(at("bark.btfm")));
    expect_seconds(object, {"read", "analysis", "fit", "total"});

    const json info = expect_object({"info", at("bark.btfm")});
    EXPECT_EQ(info["regions"], object["regions"]);
    expect_keys(info, {"software", "picture_bytes", "reasons"});
    const Ended text = btfield({"info", at("bark.btfm")});
    EXPECT_NE(text.out.find("4 regions"), std::string::npos) << text.out;
    EXPECT_NE(text.out.find("explain"), std::string::npos) << text.out;

    const json grown = expect_object({"synth", at("bark.btfm"), "-o", at("t.png"), "--size", "160x128",
                                      "--count", "2", "--save-labels", at("l.png")});
    expect_keys(grown,
                {"outputs", "size", "seeds", "tileable", "clamped_pixels", "device", "shares", "seconds"});
    EXPECT_EQ(grown["shares"].size(), 4U);
    EXPECT_EQ(grown["tileable"], true);
    EXPECT_EQ(read_picture(at("t-0.png")).image.size(), (Size{128, 160}));
    EXPECT_NE(test::bytes_of(at("t-0.png")), test::bytes_of(at("t-1.png")));

    // The labels that were written give the texture again.
    const json painted =
        expect_object({"synth", at("bark.btfm"), "-o", at("p.png"), "--control", at("l-0.png")});
    EXPECT_EQ(painted["size"], json::array({160, 128}));
    EXPECT_EQ(test::bytes_of(at("p.png")), test::bytes_of(at("t-0.png")));
}

TEST_F(CliCompound, FitSaysWhatIsKept) {
    const Ended ended = btfield(
        {"compound", "fit", data + "/bark.png", "-o", at("b.btfm"), "--crop", "0,0,96,80", "--regions", "4"});
    ASSERT_EQ(ended.code, 0) << ended.err;
    EXPECT_NE(ended.out.find("It keeps the colours of 4 regions"), std::string::npos) << ended.out;
    EXPECT_NE(ended.out.find("structure distance"), std::string::npos) << ended.out;
    EXPECT_LT(ended.out.find("It keeps"), ended.out.find("borders; labels explain"));
    EXPECT_NE(ended.out.find("certificate  colour\n"), std::string::npos) << ended.out;
}

TEST_F(CliCompound, LabelsOfOnesOwn) {
    (void)fitted("first.json", {"--save-labels", at("labels.png")});
    const json again = expect_object({"compound", "fit", data + "/bark.png", "-o", at("second.json"),
                                      "--crop", "0,0,96,80", "--labels", at("labels.png")});
    const json first = expect_object({"info", at("first.json")});
    for (std::size_t k = 0; k < 4; ++k)
        EXPECT_EQ(again["regions"][k]["pixels"], first["regions"][k]["pixels"]);
    expect_failure({"compound", "fit", data + "/bark.png", "-o", at("x.json"), "--labels", at("labels.png")},
                   1, "one label to each pixel");
    EXPECT_FALSE(std::filesystem::exists(at("x.json")));
}

// Models come through pipes too, which can be read once.
TEST_F(CliCompound, ModelFromAPipe) {
    (void)fitted("bark.btfm");
    const std::string program = test::command_path();
    for (const std::string& command :
         {program + " info /dev/stdin --json", program + " synth /dev/stdin -o " + at("t.png") + " --json"}) {
        const Ended ended = test::run_program({"/bin/sh", "-c", "cat " + at("bark.btfm") + " | " + command});
        EXPECT_EQ(ended.code, 0) << ended.err;
    }
    EXPECT_TRUE(std::filesystem::exists(at("t.png")));
}

// Nothing that is read, or written otherwise, is written over.
TEST_F(CliCompound, LabelsHaveANameOfTheirOwn) {
    (void)fitted("bark.json", {"--save-labels", at("l.png")});
    const std::string labels = test::bytes_of(at("l.png"));
    for (const std::string& name : {at("t.png"), at("l.png"), at("none/l.png"), at("l.jpg")}) {
        const Ended ended = btfield(
            {"synth", at("bark.json"), "-o", at("t.png"), "--control", at("l.png"), "--save-labels", name});
        EXPECT_NE(ended.code, 0) << name;
        EXPECT_FALSE(std::filesystem::exists(at("t.png"))) << name;
    }
    EXPECT_EQ(test::bytes_of(at("l.png")), labels);
    expect_failure({"compound", "edit", at("bark.json"), "-o", at("l.png"), "--contrast", "2"}, 1,
                   "name of a picture");
    // Labels of a texture that is cut out of a larger lattice have its size.
    (void)expect_object(
        {"synth", at("bark.json"), "-o", at("odd.png"), "--size", "37x41", "--save-labels", at("odd-l.png")});
    EXPECT_EQ(read_picture(at("odd-l.png")).image.size(), (Size{41, 37}));
}

TEST_F(CliCompound, Edits) {
    (void)fitted("bark.json");
    (void)fitted("rock.json", {}, "/rock.png");
    const json red = expect_object({"compound", "edit", at("bark.json"), "-o", at("red.json"), "--region",
                                    "2", "--colour", "0.8,0.1,0.1", "--contrast", "0.5"});
    expect_keys(red, {"regions"});
    EXPECT_NEAR(red["regions"][2]["colour"][0].get<double>(), 0.8, 1e-9);
    EXPECT_NEAR(red["regions"][2]["contrast"].get<double>(), 0.5, 1e-9);
    EXPECT_NEAR(red["regions"][1]["contrast"].get<double>(), 1.0, 1e-9);
    const json hex = expect_object(
        {"compound", "edit", at("bark.json"), "-o", at("hex.json"), "--region", "0", "--colour", "#ff0080"});
    EXPECT_NEAR(hex["regions"][0]["colour"][2].get<double>(), 128.0 / 255.0, 1e-9);
    const json flat = expect_object(
        {"compound", "edit", at("bark.json"), "-o", at("bark.json"), "--contrast", "0.5", "--overwrite"});
    for (const json& region : flat["regions"]) EXPECT_NEAR(region["contrast"].get<double>(), 0.5, 1e-9);
    const json other = expect_object({"compound", "edit", at("bark.json"), "-o", at("mixed.json"), "--region",
                                      "1", "--from", at("rock.json") + ":3"});
    const json rock = expect_object({"info", at("rock.json")});
    EXPECT_EQ(other["regions"][1]["colour"], rock["regions"][3]["colour"]);
    (void)expect_object({"fit", data + "/rock.png", "-o", at("whole.json"), "--crop", "0,0,64,64"});
    (void)expect_object({"compound", "edit", at("bark.json"), "-o", at("whole-in.json"), "--region", "1",
                         "--from", at("whole.json")});
    (void)expect_object({"synth", at("whole-in.json"), "-o", at("whole.png")});
}

TEST_F(CliCompound, TellsOfTilesThatHoldTooLittle) {
    const auto warning = [&](const char* size) {
        const Ended ended = btfield({"compound", "fit", data + "/cork.png", "-o", at("m.btfm"), "--crop",
                                     "0,0,128,128", "--tile", size, "--json"});
        EXPECT_EQ(ended.code, 0) << ended.err;
        return ended.err;
    };
    const std::string small = warning("16x16");
    EXPECT_NE(small.find("the tile of 16 x 16 has 5 of 10 regions and 47 % of the contrast between them"),
              std::string::npos)
        << small;
    EXPECT_EQ(warning("96x96"), "");
    expect_failure(
        {"compound", "fit", data + "/cork.png", "-o", at("n.btfm"), "--crop", "0,0,128,128", "--tile", "128"},
        1, "ask for at most 114 along the shorter side, or for none");
}

TEST_F(CliCompound, ColoursOfRegionsBeforeTheyWereEdited) {
    const json object = fitted("bark.json");
    (void)expect_object(
        {"compound", "edit", at("bark.json"), "-o", at("red.json"), "--region", "0", "--colour", ".9,.1,.1"});
    const CompoundModel model = read_compound(at("bark.json"));
    Image painted({32, 32}, 3, ColourSpace::srgb);
    for (int p = 0; p < 3; ++p)
        std::ranges::fill(painted.plane(p),
                          static_cast<float>(palette(model)[0][static_cast<std::size_t>(p)]) / 255.0F);
    write_picture(at("painted.png"), painted);
    (void)expect_object({"synth", at("bark.json"), "-o", at("a.png"), "--control", at("painted.png")});
    expect_failure({"synth", at("red.json"), "-o", at("b.png"), "--control", at("painted.png")}, 1,
                   "which are others once regions were edited");
}

TEST_F(CliCompound, RefusesWhatMakesNoSense) {
    test::expect_failure(
        {"compound", "fit", data + "/bark.png", "-o", at("x.json"), "--labels", data + "/bark.png"}, 1,
        "it has more than 32 colours");
    test::expect_failure({"compound"}, 2, "compound: a command is to follow: fit, edit; see");
    test::expect_failure({"compound", "synth", at("x.json")}, 2,
                         "'synth' is no command of compound, did you mean 'btfield synth'?");
    (void)fitted("bark.json", {"--save-labels", at("l.png")});
    (void)expect_object({"fit", data + "/rock.png", "-o", at("whole.json"), "--crop", "0,0,64,64"});
    const auto edit = [&](const test::Words& more, int code, const std::string& part) {
        test::Words words{"compound", "edit", at("bark.json"), "-o", at("no.json")};
        words.insert(words.end(), more.begin(), more.end());
        expect_failure(words, code, part);
        EXPECT_FALSE(std::filesystem::exists(at("no.json")));
    };
    edit({}, 2, "nothing to edit");
    edit({"--colour", "0,0,0"}, 2, "need --region");
    edit({"--region", "4", "--colour", "0,0,0"}, 1, "no region 4");
    edit({"--region", "1", "--colour", "0,0"}, 1, "planes");
    edit({"--region", "1", "--colour", "255,0,0"}, 1, "from 0 to 1");
    edit({"--region", "1", "--colour", "red"}, 2, "neither");
    edit({"--region", "1", "--from", at("bark.json")}, 1, "which of the model's regions");
    edit({"--region", "1", "--from", at("bark.json") + ":9"}, 1, "no region 9");
    edit({"--region", "1", "--from", at("whole.json") + ":0"}, 1, "has no regions");
    expect_failure({"compound", "edit", at("whole.json"), "-o", at("no.json"), "--contrast", "2"}, 1,
                   "format");
    expect_failure({"compound", "fit", data + "/bark.png", "-o", at("no.json"), "--regions", "0"}, 2, "auto");
    expect_failure({"compound", "fit", data + "/bark.png", "-o", at("no.png")}, 1, "name of a picture");
    expect_failure({"synth", at("whole.json"), "-o", at("no.png"), "--control", at("l.png")}, 1,
                   "without regions");
    expect_failure({"synth", at("bark.json"), "-o", at("no.png"), "--method", "raster"}, 1, "compound");
    expect_failure(
        {"synth", at("bark.json"), "-o", at("no.png"), "--control", at("l.png"), "--size", "32x32"}, 1,
        "labels are");
    expect_failure({"synth", at("bark.json"), "-o", at("no.png"), "--control", data + "/rock.png"}, 1,
                   "colour");
    EXPECT_FALSE(std::filesystem::exists(at("no.png")));
}

}  // namespace
}  // namespace btfield
