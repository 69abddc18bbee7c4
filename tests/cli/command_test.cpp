// The command line as users' scripts see it: the built program in a process of its own.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "btfield/image_io.hpp"
#include "btfield/model_file.hpp"
#include "tests/cli_cases.hpp"
#include "tests/example_model.hpp"
#include "tests/run_program.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::btfield;
using test::bytes_of;
using test::Ended;
using test::expect_failure;
using test::expect_keys;
using test::expect_object;
using test::put_model;
using test::Surroundings;
using test::TemporaryFolder;
using test::text_of;
using test::Words;

const std::string data = BTFIELD_TEST_DATA;

/// Numbers of seconds, none negative.
void expect_seconds(const json& object, const Words& keys) {
    ASSERT_TRUE(object.contains("seconds"));
    for (const std::string& key : keys) {
        ASSERT_TRUE(object["seconds"].contains(key)) << key;
        EXPECT_GE(object["seconds"][key].get<double>(), 0.0) << key;
    }
}

void expect_model_keys(const json& object) {
    expect_keys(object, {"model", "output", "planes", "size", "marginals", "levels", "parameters", "bytes",
                         "compression_ratio"});
    for (const json& level : object["levels"]) {
        expect_keys(level,
                    {"size", "offsets", "estimator", "gain", "certificate", "log_likelihood", "iterations"});
        expect_keys(level["certificate"], {"valid", "min_singular", "variance_ratio"});
        EXPECT_EQ(level["certificate"]["variance_ratio"].size(), object["planes"].get<std::size_t>());
    }
}

// Help and usage
// -----------------------------------------------------------------------------------------------

TEST(Cli, Version) {
    const Ended ended = btfield({"--version"});
    EXPECT_EQ(ended.code, 0);
    EXPECT_EQ(ended.out.rfind("btfield ", 0), 0U);
    EXPECT_EQ(ended.err, "");
}

TEST(Cli, HelpHasExamplesAndEveryPromisedOption) {
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
        EXPECT_NE(ended.out.find("Examples:\n  btfield "), std::string::npos) << ended.out;
        for (const std::string& option : options)
            EXPECT_NE(ended.out.find(option), std::string::npos) << option;
    }
}

TEST(Cli, WrongUsage) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    const std::vector<std::pair<Words, std::string>> all{
        {{}, "subcommand"},
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
        {{"info", "m.json", "n.json"}, "n.json"},
        {{"synth", "m.json", "-o", "t.png", "--size", "0x10"}, "--size"},
        {{"synth", "m.json", "-o", "t.png", "--size", "99999999999x5"}, "--size"},
        {{"synth", "m.json", "-o", "t.png", "--size", "64"}, "--size"},
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

// The road
// -----------------------------------------------------------------------------------------------------

TEST(Cli, Devices) {
    const json object = expect_object({"devices"});
    ASSERT_FALSE(object["devices"].empty());
    int defaults = 0;
    for (const json& device : object["devices"]) {
        expect_keys(device,
                    {"platform", "name", "type", "default", "compute_units", "vector_width", "memory_bytes"});
        const std::string type = device["type"];
        EXPECT_TRUE(type == "cpu" || type == "gpu" || type == "accelerator") << type;
        EXPECT_GT(device["compute_units"].get<int>(), 0);
        EXPECT_GT(device["memory_bytes"].get<std::uint64_t>(), 0U);
        defaults += device["default"].get<bool>() ? 1 : 0;
    }
    EXPECT_EQ(defaults, 1);
    const Ended plain = btfield({"devices"});
    EXPECT_EQ(plain.code, 0);
    EXPECT_NE(plain.out.find(object["devices"][0]["name"].get<std::string>()), std::string::npos);
}

TEST(Cli, FromPictureToTexture) {
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
    const json same = expect_object({"compare", picture, picture}, here);
    EXPECT_EQ(same["lag_covariance_error"], 0.0);
    EXPECT_EQ(same["planes"][0]["quantile_error"], 0.0);
    EXPECT_EQ(folder.names(), (Words{"cork.json", "more.png"}));
}

TEST(Cli, PlainReports) {
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

TEST(Cli, OptionsReachTheFit) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    const json object = expect_object({"fit",
                                       data + "/grass.png",
                                       "-o",
                                       "m.json",
                                       "--model",
                                       "3d-msar",
                                       "--order",
                                       "3",
                                       "--neighbourhood",
                                       "unilateral",
                                       "--levels",
                                       "2",
                                       "--factor",
                                       "3",
                                       "--estimator",
                                       "ls",
                                       "--noise",
                                       "diagonal",
                                       "--gains",
                                       "none",
                                       "--crop",
                                       "10,20,90,60",
                                       "--device",
                                       "auto"},
                                      here);
    EXPECT_EQ(object["model"], "3d-msar");
    EXPECT_EQ(object["size"], json::array({90, 60}));
    EXPECT_EQ(object["levels"].size(), 2U);
    EXPECT_EQ(object["levels"][1]["size"], json::array({30, 20}));
    EXPECT_EQ(object["levels"][0]["offsets"], 5);  // s1, s2 <= 0, s1² + s2² <= 4
    EXPECT_EQ(object["levels"][0]["gain"], 1.0);
    EXPECT_EQ(object["levels"][1]["gain"], 1.0);
    const TextureModel model = read_model(folder / "m.json");
    EXPECT_EQ(model.noise, NoiseForm::diagonal);
    EXPECT_EQ(model.factor, 3);
    EXPECT_EQ(linear_field(model.levels[0].models.front()).kind, NeighbourhoodKind::unilateral);
    EXPECT_EQ(model.provenance.picture_bytes, 90U * 60U);
}

TEST(Cli, SeveralPictures) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    std::filesystem::create_directory(folder / "models");
    const Words fast{"--levels", "1", "--order", "1", "--crop", "0,0,64,64"};
    Words words{"fit", data + "/cork.png", data + "/grass.png", "-o", "models"};
    words.insert(words.end(), fast.begin(), fast.end());
    const json object = expect_object(words, here);
    ASSERT_EQ(object["fits"].size(), 2U);
    for (const json& fitted : object["fits"]) {
        expect_model_keys(fitted);
        expect_seconds(fitted, {"read", "analysis", "fit", "total"});
    }
    EXPECT_EQ(read_model(folder / "models/cork.json").planes, 3);
    EXPECT_EQ(read_model(folder / "models/grass.json").planes, 1);

    std::filesystem::remove_all(folder / "models");
    std::filesystem::create_directory(folder / "models");
    words[2] = "absent.png";  // the first picture alone could be fitted
    expect_failure(words, 1, "absent.png", here);
    words[2] = data + "/../data/cork.png";
    expect_failure(words, 2, "cork.json", here);
    EXPECT_TRUE(std::filesystem::is_empty(folder / "models"));
}

TEST(Cli, ManySeeds) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    put_model(folder / "m.json");
    const json object = expect_object(
        {"synth", "m.json", "-o", "t.v1.exr", "--count", "11", "--seed", "100", "--size", "16x8"}, here);
    ASSERT_EQ(object["outputs"].size(), 11U);
    for (int i = 0; i < 11; ++i) {
        const auto n = static_cast<std::size_t>(i);
        EXPECT_EQ(object["outputs"][n],
                  std::string("t.v1-") + (i < 10 ? "0" : "") + std::to_string(i) + ".exr");
        EXPECT_EQ(object["seeds"][n], 100 + i);
        EXPECT_TRUE(std::filesystem::exists(folder / object["outputs"][n].get<std::string>()));
    }
    // Texture i is the texture of seed N + i, whatever batch it was in.
    expect_object({"synth", "m.json", "-o", "alone.exr", "--seed", "110", "--size", "16x8"}, here);
    const Image alone = read_picture(folder / "alone.exr").image,
                last = read_picture(folder / "t.v1-10.exr").image;
    const Image first = read_picture(folder / "t.v1-00.exr").image;
    float largest = 0.0F, difference = 0.0F, others = 0.0F;
    for (std::size_t i = 0; i < alone.values().size(); ++i) {
        largest = std::max(largest, std::abs(alone.values()[i]));
        difference = std::max(difference, std::abs(alone.values()[i] - last.values()[i]));
        others = std::max(others, std::abs(alone.values()[i] - first.values()[i]));
    }
    // EXR holds halves (2^-11), and results of one seed agree to 1e-5 of full scale.
    EXPECT_LE(difference, largest * (1.0F / 2048.0F + 1e-5F));
    EXPECT_GT(others, difference);
    expect_failure({"synth", "m.json", "-o", "none/t.png", "--count", "3"}, 1, "none", here);
}

TEST(Cli, ProfileGoesToStandardError) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    put_model(folder / "m.json");
    const Ended ended =
        btfield({"synth", "m.json", "-o", "t.png", "--size", "32x32", "--profile", "--json"}, here);
    EXPECT_EQ(ended.code, 0);
    EXPECT_TRUE(json::parse(ended.out, nullptr, false).is_object()) << ended.out;
    EXPECT_EQ(ended.err.rfind("kernel ", 0), 0U) << ended.err;
    EXPECT_NE(ended.err.find("fft"), std::string::npos) << ended.err;
}

TEST(Cli, NoiseDomainsDiffer) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    put_model(folder / "m.json");
    expect_object({"synth", "m.json", "-o", "a.png", "--size", "32x32"}, here);
    expect_object({"synth", "m.json", "-o", "b.png", "--size", "32x32", "--noise-domain", "spatial"}, here);
    EXPECT_NE(bytes_of(folder / "a.png"), bytes_of(folder / "b.png"));
}

TEST(Cli, ClampedPixelsAreCounted) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    TextureModel model = test::example_model(ModelKind::car3d, 3, 1);
    model.mean.assign(3, 1.5);  // 25 standard deviations above white
    put_model(folder / "m.json", model);
    EXPECT_EQ(expect_object({"synth", "m.json", "-o", "t.png", "--size", "20x10"}, here)["clamped_pixels"],
              200);
    EXPECT_EQ(expect_object({"synth", "m.json", "-o", "t.exr", "--size", "20x10"}, here)["clamped_pixels"],
              0);
}

TEST(Cli, ModelsThatDoNotCertify) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    // Least squares on a symmetric support does not certify on real pictures: theory 7.3.
    const Words words{"fit",
                      data + "/grass.png",
                      "-o",
                      "m.json",
                      "--model",
                      "3d-msar",
                      "--neighbourhood",
                      "symmetric",
                      "--order",
                      "1",
                      "--levels",
                      "1",
                      "--crop",
                      "0,0,64,64",
                      "--estimator",
                      "ls",
                      "--json"};
    const Ended fitted = btfield(words, here);
    EXPECT_EQ(fitted.code, 0) << fitted.err;
    EXPECT_EQ(fitted.err.rfind("btfield: warning: ", 0), 0U) << fitted.err;
    EXPECT_EQ(std::count(fitted.err.begin(), fitted.err.end(), '\n'), 1) << fitted.err;
    EXPECT_NE(fitted.err.find("--allow-invalid"), std::string::npos) << fitted.err;
    const json object = json::parse(fitted.out);
    EXPECT_EQ(object["levels"][0]["certificate"]["valid"], false);
    EXPECT_TRUE(object["levels"][0]["log_likelihood"].is_null());

    EXPECT_EQ(btfield({"info", "m.json"}, here).code, 0);
    expect_failure({"synth", "m.json", "-o", "t.png"}, 1, "--allow-invalid", here);
    EXPECT_EQ(folder.names(), Words{"m.json"});
    const Ended insisted = btfield({"synth", "m.json", "-o", "t.exr", "--allow-invalid"}, here);
    EXPECT_EQ(insisted.code, 0) << insisted.err;
    EXPECT_EQ(insisted.err.rfind("btfield: warning: ", 0), 0U) << insisted.err;
    EXPECT_TRUE(std::filesystem::exists(folder / "t.exr"));
}

// Streams
// ------------------------------------------------------------------------------------------------------

TEST(Cli, ResultsThatCannotBePrinted) {
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

TEST(Cli, ClosedOutputDoesNotEndUpInTheTexture) {
    const TemporaryFolder folder;
    put_model(folder / "m.json");
    expect_failure({"synth", "m.json", "-o", "t.png", "--size", "32x32"}, 1, "standard output",
                   {.folder = folder.path().string(), .close_out = true});
    EXPECT_EQ(read_picture(folder / "t.png").image.size(), (Size{32, 32}));
}

TEST(Cli, ProgressIsForTerminals) {
    const TemporaryFolder folder;
    Surroundings here{.folder = folder.path().string(), .terminal = true};
    const Words words{"fit", data + "/grass.png", "-o", "m.json", "--levels", "1", "--order", "1", "--json"};
    const Ended seen = btfield(words, here);
    EXPECT_EQ(seen.code, 0);
    EXPECT_TRUE(json::parse(seen.out, nullptr, false).is_object()) << seen.out;
    EXPECT_NE(seen.err.find("grass.png"), std::string::npos) << seen.err;
    const std::string cleared = "\r\x1b[K";
    EXPECT_EQ(seen.err.substr(seen.err.size() - cleared.size()), cleared);
    here.terminal = false;
    EXPECT_EQ(btfield(words, here).err, "");
}

}  // namespace
}  // namespace btfield
