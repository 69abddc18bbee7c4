// What btfield synth --export blender writes, run by Blender itself: `./dev test blender`.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "btfield/image_io.hpp"
#include "tests/cli_cases.hpp"
#include "tests/material_cases.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using test::Ended;
using test::Words;

class CliExportBlender : public testing::Test {
  protected:
    void SetUp() override {
        test::put_material(folder_.path());
        test::put_scalar_maps(folder_.path());
        run({"fit", "s_albedo.png", "s_normal.png", "s_height.png", "s_roughness.png", "s_metalness.png",
             "s_opacity.png", "--joint", "-o", "s.json"});
    }
    void run(const Words& words) {
        const Ended ended = test::btfield(words, {.folder = folder_.path().string()});
        ASSERT_EQ(ended.code, 0) << ended.err;
    }
    /// Blender goes by $PWD: names are whole.
    Ended blender(const std::string& program, const Words& more) {
        Words words{"-P", (folder_ / program).string()};
        words.insert(words.end(), more.begin(), more.end());
        words.insert(words.begin(), {"/usr/bin/env", "blender", "-b", "-noaudio", "--factory-startup",
                                     "--python-exit-code", "1"});
        return test::run_program(std::move(words), {.folder = folder_.path().string()});
    }
    /// The plane under this light, and whether anything is seen at all.
    Image rendered(const std::string& program, const std::string& light) {
        const Ended ended = blender(program, {"--", "--render", "plane.png", "--light", light, "--view",
                                              "0,-90", "--size", "96", "72", "--samples", "4"});
        EXPECT_EQ(ended.code, 0) << ended.out << ended.err;
        const Picture picture = read_picture(folder_ / "plane.png");
        EXPECT_EQ(picture.image.size(), (Size{72, 96}));
        return picture.image;
    }
    test::TemporaryFolder folder_;
};

double mean_of(const Image& image) {
    double sum = 0.0;
    for (const float value : image.values()) sum += static_cast<double>(value);
    return sum / static_cast<double>(image.values().size());
}

double difference(const Image& a, const Image& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.values().size(); ++i)
        sum += std::abs(static_cast<double>(a.values()[i]) - static_cast<double>(b.values()[i]));
    return sum / static_cast<double>(a.values().size());
}

TEST_F(CliExportBlender, BuildsWhatMaterialJsonTells) {
    const std::string check = test::source_folder() + "/tests/blender/check_material.py";
    run({"synth", "s.json", "-o", "out", "--export", "blender", "--pixel-size", "2"});
    run({"synth", "s.json", "-o", "wide", "--export", "blender", "--size", "96x48", "--convention",
         "directx"});
    for (const char* program : {"out/s.py", "wide/s.py"}) {
        const Ended ended = blender(program, {"-P", check});
        EXPECT_EQ(ended.code, 0) << ended.out << ended.err;
        EXPECT_NE(ended.out.find("ALL RIGHT"), std::string::npos) << ended.out << ended.err;
    }
}

TEST_F(CliExportBlender, RendersARelief) {
    run({"synth", "s.json", "-o", "gl", "--export", "blender"});
    run({"synth", "s.json", "-o", "dx", "--export", "blender", "--convention", "directx"});
    const Image left = rendered("gl/s.py", "60,180"), right = rendered("gl/s.py", "60,0");
    EXPECT_GT(mean_of(left), 0.05);
    EXPECT_LT(mean_of(left), 0.9);
    const double sides = difference(left, right);
    EXPECT_GT(sides, 0.05);
    // Whichever way green points in the file, the surface is one.
    const Image below = rendered("gl/s.py", "60,-90");
    EXPECT_LT(difference(rendered("dx/s.py", "60,-90"), below), 0.1 * sides);
    EXPECT_GT(difference(rendered("dx/s.py", "60,90"), below), 0.5 * sides);
}

TEST_F(CliExportBlender, TellsWhatIsMissing) {
    run({"synth", "s.json", "-o", "out", "--export", "blender"});
    std::filesystem::remove(folder_ / "out/s_normal.png");
    const Ended ended = blender("out/s.py", {"--", "--render", "plane.png"});
    EXPECT_NE(ended.code, 0);
    EXPECT_NE((ended.out + ended.err).find("there is no s_normal.png"), std::string::npos) << ended.err;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "plane.png"));
}

}  // namespace
}  // namespace btfield
