// The command line as users' scripts see it: the built program in a process of its own.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "btfield/image_io.hpp"
#include "btfield/model_file.hpp"
#include "tests/cli_cases.hpp"
#include "tests/json_text.hpp"
#include "tests/places.hpp"
#include "tests/run_program.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::btfield;
using test::Ended;
using test::expect_failure;
using test::expect_keys;
using test::expect_model_keys;
using test::expect_object;
using test::expect_seconds;
using test::put_model;
using test::Running;
using test::Surroundings;
using test::TemporaryFolder;
using test::text_of;
using test::Words;

const std::string data = test::data_folder();

// Help and usage
// -----------------------------------------------------------------------------------------------

TEST(CliCommand, Version) {
    const Ended ended = btfield({"--version"});
    EXPECT_EQ(ended.code, 0);
    EXPECT_EQ(ended.out.rfind("btfield ", 0), 0U);
    EXPECT_EQ(ended.err, "");
    EXPECT_EQ(btfield({"-V"}).out, ended.out);
}

TEST(CliCommand, WordsThatAreNoCommandsSuggestOne) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    std::filesystem::copy_file(test::data_folder() + "/sand.png", folder / "sand.png");
    put_model(folder / "m.json");
    expect_failure({"sand.png"}, 2, "did you mean 'btfield fit sand.png -o sand.json'?", here);
    expect_failure({"m.json"}, 2, "did you mean 'btfield synth m.json -o m.png'?", here);
    expect_failure({"sandy.png"}, 2, "'sandy.png' is no command; see", here);
}

TEST(CliCommand, HelpHasExamplesAndEveryPromisedOption) {
    const std::vector<std::pair<Words, Words>> promised{
        {{}, {"devices", "fit", "info", "synth", "compare", "--version"}},
        {{"devices"}, {"--json"}},
        {{"fit"},
         {"--output", "--model 2d-car|3d-car|2d-ma|3d-ma|2d-msar|3d-msar|2d-mmrf|3d-mmrf|2d-pmrf|3d-pmrf",
          "--order", "--neighbourhood causal|unilateral|symmetric|half", "--levels", "--factor",
          "--estimator auto|ls", "--noise full|diagonal", "--gains match|none", "--crop X,Y,W,H", "--device",
          "--json"}},
        {{"info"}, {"--json"}},
        {{"synth"},
         {"--output", "--size WxH", "--seed", "--count", "--device SPEC", "--noise-domain frequency|spatial",
          "--method torus|raster", "--allow-invalid", "--profile", "--json"}},
        {{"compare"}, {"--json"}},
    };
    for (auto [words, options] : promised) {
        words.emplace_back("--help");
        SCOPED_TRACE(text_of(words));
        const Ended ended = btfield(words);
        EXPECT_EQ(ended.code, 0);
        EXPECT_EQ(ended.err, "");
        EXPECT_NE(ended.out.find("\n  btfield "), std::string::npos) << ended.out;
        const std::string unfolded = std::regex_replace(ended.out, std::regex("\\|\n +"), "|");
        for (const std::string& option : options)
            EXPECT_NE(unfolded.find(option), std::string::npos) << option;
    }
}

TEST(CliCommand, WrongUsage) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    const std::vector<std::pair<Words, std::string>> all{
        {{}, "a command is to follow: fit, synth, "},
        {{"paint"}, "'paint' is no command"},
        {{"--paint"}, "'--paint' is no option"},
        {{"fit"}, "IMAGE"},
        {{"fit", "a.png"}, "--output"},
        {{"fit", "a.png", "b.png", "-o", "m.json"}, "folder"},
        {{"fit", "a.png", "-o", "m.json", "--levels", "-3"}, "--levels"},
        {{"fit", "a.png", "-o", "m.json", "--levels", "2.5"}, "--levels"},
        {{"fit", "a.png", "-o", "m.json", "--order", "9"}, "--order"},
        {{"fit", "a.png", "-o", "m.json", "--order", "3", "--order", "4"}, "--order"},
        {{"fit", "a.png", "-o", "m.json", "--factor", "1"}, "--factor"},
        {{"fit", "a.png", "-o", "m.json", "--model", "4d-car"},
         "2d-car|3d-car|2d-ma|3d-ma|2d-msar|3d-msar|2d-mmrf|3d-mmrf|2d-pmrf|3d-pmrf"},
        {{"fit", "a.png", "-o", "m.json", "--crop", "0,0,5"}, "--crop"},
        {{"fit", "a.png", "-o", "m.json", "--crop", "-1,0,5,5"}, "--crop"},
        {{"info"}, "MODEL"},
        {{"info", "m.json", "--size", "3"}, "not expected: --size"},
        {{"help", "paint"}, "'paint' is no command"},
        {{"help", "experiment", "paint"}, "'paint' is no command of experiment"},
        {{"memd", "a.png", "b.png", "--map", ""}, "--map: the value is empty"},
        {{"synth", "m.json", "-o", ""}, "--output: the value is empty"},
        {{"devices", "--device="}, "--device"},
        {{"synth", "m.json", "-o", "t.png", "--size", "0x10"}, "--size"},
        {{"synth", "m.json", "-o", "t.png", "--size", "99999999999x5"}, "--size"},
        {{"synth", "m.json", "-o", "t.png", "--size", "64x"}, "--size"},
        {{"synth", "m.json", "-o", "t.png", "--size", "64x64x3"}, "--size"},
        {{"synth", "m.json", "-o", "t.png", "--seed", "-1"}, "--seed"},
        {{"synth", "m.json", "-o", "t.png", "--seed", "18446744073709551616"}, "--seed"},
        {{"synth", "m.json", "-o", "t.png", "--seed", "18446744073709551615", "--count", "2"}, "--seed"},
        {{"synth", "m.json", "-o", "t.png", "--count", "0"}, "--count"},
        {{"synth", "m.json", "-o", "t.png", "--noise-domain", "time"}, "frequency|spatial"},
        {{"synth", "m.json", "-o", "t.png", "--bogus\nline"}, "--bogus line"},
        {{"compare", "a.png"}, "B"},
    };
    for (const auto& [words, part] : all) expect_failure(words, 2, part, here);
    EXPECT_TRUE(folder.names().empty());
}

TEST(CliCommand, NearMisses) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    const std::vector<std::pair<Words, std::string>> all{
        // What the command has in its place.
        {{"compound", "fit", "a.png", "-o", "m.json", "--model", "3d-car"}, "--local chooses"},
        {{"compound", "fit", "a.png", "-o", "m.json", "--model=3d-car"}, "--local chooses"},
        {{"compound", "fit", "a.png", "-o", "m.json", "--clusters", "3"}, "--regions says"},
        {{"fit", "a.png", "-o", "m.json", "--regions", "3"}, "'btfield compound fit'"},
        {{"fit", "a.png", "-o", "m.json", "--size", "64"}, "'btfield synth MODEL -o IMAGE'"},
        {{"fit", "a.png", "-o", "m.json", "--height", "h.png"}, "--joint and --roles"},
        {{"btf", "fit", "set", "-o", "m.json", "--local", "3d-car"}, "--model chooses"},
        {{"synth", "m.json", "-o", "t.png", "--order", "3"}, "when the model was fitted"},
        {{"btf", "synth", "m.btfm", "-o", "t.png", "--order", "3"}, "'btfield btf fit' when"},
        {{"btf", "view", "m.btfm", "-o", "t.html", "--light", "3,4"}, "the page's reader"},
        {{"roll", "a.png", "-o", "t.png", "--model", "3d-car"}, "without a model"},
        // What is spelt nearly so.
        {{"fit", "a.png", "-o", "m.json", "--level", "3"}, "did you mean --levels?"},
        {{"fit", "a.png", "-o", "m.json", "--neighborhood", "causal"}, "did you mean --neighbourhood?"},
        {{"fit", "a.png", "-o", "m.json", "-model", "3d-car"}, "did you mean --model?"},
        // Whose it is.
        {{"fit", "a.png", "-o", "m.json", "--metric", "lab"}, "it is an option of 'btfield memd';"},
        {{"compound", "edit", "m.json", "-o", "n.json", "--local", "3d-car"},
         "it is an option of 'btfield compound fit';"},
    };
    for (const auto& [words, part] : all) expect_failure(words, 2, part, here);
    expect_failure({"fit", "a.png", "-o", "m.json", "--zorro"}, 2, "not expected: --zorro; see 'btfield fit",
                   here);
    EXPECT_TRUE(folder.names().empty());
}

// The road
// -----------------------------------------------------------------------------------------------------

TEST(CliCommand, PicturesOfTheModuleAreReadAndWritten) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    expect_object({"fit", data + "/cork-xyz.exr", "-o", "xyz.json"}, here);
    expect_object({"fit", data + "/cork.png", "-o", "cork.json"}, here);
    for (const char* name : {"cork.exr", "cork.tif", "cork.jpg"}) {
        expect_object({"synth", "cork.json", "-o", name, "--size", "32"}, here);
        EXPECT_EQ(read_picture(folder / name).image.size(), (Size{32, 32})) << name;
    }
}

TEST(CliCommand, FromPictureToTexture) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    const std::string picture = data + "/cork.png";

    const json fitted = expect_object({"fit", picture, "-o", "cork.json"}, here);
    expect_model_keys(fitted);
    expect_seconds(fitted, {"read", "analysis", "fit", "total"});
    EXPECT_EQ(fitted["model"], "3d-car");
    EXPECT_EQ(fitted["output"], "cork.json");
    EXPECT_EQ(fitted["planes"], 3);
    EXPECT_EQ(fitted["size"], json::array({512, 512}));
    EXPECT_EQ(fitted["marginals"], "match");
    EXPECT_EQ(fitted["levels"].size(), 5U);
    EXPECT_EQ(fitted["levels"][0]["offsets"], 12);  // order 5, causal
    EXPECT_EQ(fitted["levels"][1]["size"], json::array({256, 256}));
    EXPECT_EQ(fitted["levels"][0]["estimator"], "ls");
    EXPECT_EQ(fitted["bytes"], std::filesystem::file_size(folder / "cork.json"));
    EXPECT_DOUBLE_EQ(fitted["compression_ratio"].get<double>(),
                     512.0 * 512.0 * 3.0 / fitted["bytes"].get<double>());
    EXPECT_EQ(fitted["parameters"], parameter_count(read_model(folder / "cork.json")));
    const TextureModel model = read_model(folder / "cork.json");
    EXPECT_EQ(model.provenance.source, "cork.png");
    EXPECT_EQ(model.provenance.picture_bytes, 512U * 512U * 3U);

    json told = expect_object({"info", "cork.json"}, here);
    expect_model_keys(told);
    EXPECT_TRUE(told.contains("reasons"));
    EXPECT_FALSE(told.contains("seconds"));
    for (const auto& [key, value] : fitted.items()) {
        if (key != "seconds") {
            EXPECT_EQ(told[key], value) << key;
        }
    }

    const json grown =
        expect_object({"synth", "cork.json", "-o", "more.png", "--size", "640x320", "--seed", "7"}, here);
    expect_keys(grown, {"outputs", "size", "seeds", "tileable", "clamped_pixels", "device", "seconds"});
    expect_seconds(grown, {"setup", "per_texture", "write", "total"});
    EXPECT_EQ(grown["outputs"], json::array({"more.png"}));
    EXPECT_EQ(grown["size"], json::array({640, 320}));
    EXPECT_EQ(grown["seeds"], json::array({7}));
    EXPECT_EQ(grown["tileable"], true);
    const Picture texture = read_picture(folder / "more.png");
    EXPECT_EQ(texture.image.size(), (Size{320, 640}));
    EXPECT_EQ(texture.image.planes(), 3);
    EXPECT_EQ(texture.type, PixelType::uint8);

    const json compared = expect_object({"compare", picture, "more.png"}, here);
    expect_keys(compared, {"planes", "lag_covariance_error", "spectral_covariance_error"});
    ASSERT_EQ(compared["planes"].size(), 3U);
    for (const json& plane : compared["planes"]) {
        EXPECT_EQ(plane["mean"].size(), 2U);
        EXPECT_EQ(plane["std"].size(), 2U);
        // A texture of 640 x 320 with some 20 pixels of correlation has about 500 independent patches: the
        // standard deviation of its standard deviation is near 1 / sqrt(2 · 500) = 3 %; five of them.
        EXPECT_LE(std::abs(plane["std_ratio"].get<double>() - 1.0), 0.15);
        // That of its mean is 1 / sqrt(500) = 4.5 %; five of both, and a tenth for the shape.
        EXPECT_LE(plane["quantile_error"].get<double>(), std::hypot(0.15, 0.225) + 0.1);
        EXPECT_DOUBLE_EQ(plane["std_ratio"].get<double>(),
                         plane["std"][1].get<double>() / plane["std"][0].get<double>());
    }
    EXPECT_EQ(folder.names(), (Words{"cork.json", "more.png"}));
}

TEST(CliCommand, PlainReports) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    const std::vector<std::pair<Words, std::string>> all{
        {{"fit", data + "/bark.png", "-o", "m.btfm", "--levels", "2", "--order", "2"}, "wrote m.btfm"},
        {{"info", "m.btfm"}, "compression ratio"},
        {{"synth", "m.btfm", "-o", "t.png"}, "it tiles"},
        {{"synth", "m.btfm", "-o", "odd.png", "--size", "63x64"}, "does not tile"},
        {{"compare", data + "/bark.png", "t.png"}, "lag covariance error"},
    };
    for (const auto& [words, part] : all) {
        const Ended ended = btfield(words, here);
        EXPECT_EQ(ended.code, 0) << ended.err;
        EXPECT_EQ(ended.err, "");
        EXPECT_NE(ended.out.find(part), std::string::npos) << ended.out;
    }
    EXPECT_EQ(read_picture(folder / "t.png").image.size(), (Size{256, 256}));  // as the analysed picture
}

// Limits
// ------------------------------------------------------------------------------------------------------

TEST(CliCommand, ThreadsAndMemoryAreBounded) {
    const TemporaryFolder folder;
    put_model(folder / "m.json");
    const Surroundings here{.folder = folder.path().string()};
    EXPECT_EQ(btfield({"synth", "m.json", "-o", "all.png", "--size", "64x64"}, here).code, 0);
    for (const Words& words :
         {Words{"--threads", "1", "synth", "m.json", "-o", "one.png", "--size", "64x64"},
          Words{"synth", "m.json", "-o", "one.png", "--size", "64x64", "--threads=1", "--memory", "1G"}}) {
        const Ended ended = btfield(words, here);
        EXPECT_EQ(ended.code, 0) << ended.err;
        EXPECT_EQ(test::bytes_of(folder / "one.png"), test::bytes_of(folder / "all.png"));
    }
    expect_failure(
        {"synth", "m.json", "-o", "large.png", "--size", "4096x4096", "--memory", "20MB", "--device", "cpu"},
        3, "20.0 MB may be used", here);
    expect_failure({"synth", "m.json", "-o", "large.png", "--size", "4096x4096", "--memory", "20MB"}, 3,
                   "allow more device memory (--memory)", here);
    const Ended by_environment =
        test::run_program({"/usr/bin/env", "BTFIELD_MEMORY=20MB", test::command_path(), "synth", "m.json",
                           "-o", "large.png", "--size", "4096x4096"},
                          here);
    EXPECT_EQ(by_environment.code, 3);
    EXPECT_NE(by_environment.err.find("($BTFIELD_MEMORY)"), std::string::npos) << by_environment.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "large.png"));
    for (const char* threads : {"0", "-1", "two", "1.5", ""})
        expect_failure({"info", "m.json", "--threads", threads}, 2, "--threads", here);
    for (const char* memory : {"0", "much", "4 G", "-1G", ""})
        expect_failure({"info", "m.json", "--memory", memory}, 2, "--memory", here);
    const Words with_environment{
        "/usr/bin/env", "BTFIELD_THREADS=none", test::command_path(), "synth", "m.json", "-o", "t.png"};
    const Ended ended = test::run_program(with_environment, here);
    EXPECT_EQ(ended.code, 1);
    EXPECT_EQ(ended.err.rfind("btfield: use as many threads as $BTFIELD_THREADS says: it is 'none'", 0), 0U)
        << ended.err;
}

// Streams
// ------------------------------------------------------------------------------------------------------

TEST(CliCommand, ResultsThatCannotBePrinted) {
    const TemporaryFolder folder;
    put_model(folder / "m.json");
    for (const char* form : {"--json", "--verbose"}) {
        expect_failure({"info", "m.json", form}, 1, "standard output",
                       {.folder = folder.path().string(), .out = "/dev/full"});
        expect_failure({"info", "m.json", form}, 1, "standard output",
                       {.folder = folder.path().string(), .close_out = true});
    }
    expect_failure({"--help"}, 1, "standard output", {.out = "/dev/full"});
}

TEST(CliCommand, ClosedOutputDoesNotEndUpInTheTexture) {
    const TemporaryFolder folder;
    put_model(folder / "m.json");
    expect_failure({"synth", "m.json", "-o", "t.png", "--size", "32x32"}, 1, "standard output",
                   {.folder = folder.path().string(), .close_out = true});
    EXPECT_EQ(read_picture(folder / "t.png").image.size(), (Size{32, 32}));
}

TEST(CliCommand, ProgressIsForTerminals) {
    const TemporaryFolder folder;
    Surroundings here{.folder = folder.path().string(), .terminal = true};
    const Words words{"fit", data + "/grass.png", "-o", "m.json", "--levels", "1", "--order", "1", "--json"};
    const Ended seen = btfield(words, here);
    EXPECT_EQ(seen.code, 0);
    EXPECT_TRUE(test::holds_object(seen.out)) << seen.out;
    EXPECT_NE(seen.err.find("grass.png"), std::string::npos) << seen.err;
    const std::string cleared = "\r\x1b[K";
    EXPECT_EQ(seen.err.substr(seen.err.size() - cleared.size()), cleared);
    here.terminal = false;
    EXPECT_EQ(btfield(words, here).err, "");
}

/// Lines come every ten seconds: the command is held up for so long.
TEST(CliCommandLong, ProgressIsALineNowAndThenWithoutATerminal) {
    const TemporaryFolder folder;
    const auto begun = [&](const std::string& out, Words more) {
        Words words{
            test::command_path(), "synth", "m.json", "-o", out + "/", "--count", "20000", "--size", "64"};
        words.insert(words.end(), more.begin(), more.end());
        return words;
    };
    put_model(folder / "m.json");
    const Surroundings here{.folder = folder.path().string()};
    for (const char* name : {"people", "json", "quiet"}) std::filesystem::create_directory(folder / name);
    Running people(begun("people", {}), folder / "people", here),
        object(begun("json", {"--json"}), folder / "json", here),
        quiet(begun("quiet", {"--quiet"}), folder / "quiet", here);
    const std::array<std::pair<Running*, const char*>, 3> all{
        {{&people, "people"}, {&object, "json"}, {&quiet, "quiet"}}};
    const auto pictures = [&](const char* name) {
        return std::distance(std::filesystem::directory_iterator(folder / name), {});
    };
    for (const auto& [run, name] : all)
        while (pictures(name) < 4) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    for (const auto& [run, name] : all) run->kill(SIGSTOP);
    std::this_thread::sleep_for(std::chrono::milliseconds(10100));
    for (const auto& [run, name] : all) {
        const auto before = pictures(name);
        run->kill(SIGCONT);
        while (pictures(name) < before + 8) std::this_thread::sleep_for(std::chrono::milliseconds(5));
        run->kill(SIGKILL);
        run->wait();
    }
    EXPECT_NE(people.err().find(" %: "), std::string::npos) << people.err();
    EXPECT_EQ(std::ranges::count(people.err(), '\n'), 1) << people.err();
    EXPECT_EQ(object.err(), "");
    EXPECT_EQ(quiet.err(), "");
}

/// Also where nothing ends for so long, and says in which stage.
TEST(CliCommandLong, ProgressIsToldWithinLongStages) {
    const TemporaryFolder folder;
    Running run({test::command_path(), "fit", data + "/landsat.tif", "-o", "m.json", "--model", "3d-pmrf"},
                folder.path(), {.folder = folder.path().string()});
    std::this_thread::sleep_for(std::chrono::seconds(1));
    run.kill(SIGSTOP);
    std::this_thread::sleep_for(std::chrono::milliseconds(10100));
    run.kill(SIGCONT);
    std::this_thread::sleep_for(std::chrono::seconds(1));
    run.kill(SIGKILL);
    run.wait();
    EXPECT_NE(run.err().find(" %: landsat.tif: fit\n"), std::string::npos) << run.err();
}

}  // namespace
}  // namespace btfield
