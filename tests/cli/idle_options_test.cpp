// Options that mean nothing to the model that others choose are refused, whichever command they are given to.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/cli_cases.hpp"
#include "tests/places.hpp"
#include "tests/run_program.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using test::btfield;
using test::Ended;
using test::expect_failure;
using test::TemporaryFolder;
using test::Words;

const std::string data = test::data_folder();
const std::vector<std::string> models{"2d-car",  "3d-car",  "2d-ma",   "3d-ma",   "2d-msar",
                                      "3d-msar", "2d-mmrf", "3d-mmrf", "2d-pmrf", "3d-pmrf"};

bool is_ma(const std::string& model) {
    return model.ends_with("-ma");
}

/// An option with a value, and which models it says something of.
struct Case {
    std::string option, value;
    bool (*of)(const std::string& model);
};

const std::vector<Case> cases{
    {"--threshold", "0.7", is_ma},
    {"--significance", "p1", is_ma},
    {"--estimator", "ls", [](const std::string&) { return true; }},
    {"--estimator", "ml", [](const std::string&) { return true; }},
    {"--estimator", "auto", [](const std::string&) { return true; }},
    {"--noise", "full", [](const std::string&) { return true; }},
    {"--noise", "diagonal", [](const std::string&) { return true; }},
    {"--gains", "none", [](const std::string&) { return true; }},
    {"--marginals", "none", [](const std::string&) { return true; }},
};

TEST(CliIdleOptions, OfEachModel) {
    const TemporaryFolder folder;
    const std::string output = (folder / "m.json").string();
    for (const std::string& model : models)
        for (const auto& [option, value, of] : cases) {
            SCOPED_TRACE(model + " " + option + " " + value);
            const Words words{
                "fit",    data + "/grass.png", "-o", output,    "--crop", "0,0,32,32", "--levels",
                "1",      "--order",           "1",  "--model", model,    option,      value,
                "--json", "--overwrite"};
            if (of(model)) {
                EXPECT_EQ(btfield(words).code, 0);
                continue;
            }
            std::filesystem::remove(output);
            const Ended ended = btfield(words);
            EXPECT_EQ(ended.code, 2);
            EXPECT_EQ(ended.err.rfind("btfield: fit: " + option + ": a model of kind " + model + " has ", 0),
                      0U)
                << ended.err;
            EXPECT_NE(ended.err.find("; leave it out, or take "), std::string::npos) << ended.err;
            EXPECT_FALSE(std::filesystem::exists(output));
        }
}

TEST(CliIdleOptions, WhatChoosesTheModelHasAUseForAll) {
    const TemporaryFolder folder;
    const Words words{"fit", data + "/grass.png", "--crop", "0,0,32,32",   "--levels", "1", "--order",
                      "1",   "--threshold",       "0.7",    "--estimator", "ls"};
    Words all = words, chosen = words;
    all.insert(all.end(), {"--all", (folder / "all/").string()});
    chosen.insert(chosen.end(), {"--model", "auto", "-o", (folder / "m.json").string()});
    EXPECT_EQ(btfield(all).code, 0);
    EXPECT_EQ(btfield(chosen).code, 0);
}

TEST(CliIdleOptions, OfRegionalModelsAndTheirEstimators) {
    const TemporaryFolder folder;
    const auto refused = [&](Words more, const std::string& found) {
        Words words{"compound", "fit", data + "/grass.png", "-o", (folder / "m.btfm").string()};
        words.insert(words.end(), more.begin(), more.end());
        expect_failure(words, 2, found);
    };
    refused({"--local", "3d-msar", "--threshold", "1"}, "--threshold: a model of kind 3d-msar has");
    refused({"--local", "3d-msar", "--averages", "rd"}, "--averages: a model of kind 3d-msar has");
    refused({"--local", "2d-car", "--significance", "p1"}, "take --local 3d-ma or 2d-ma");
    refused({"--averages", "sr", "--significance", "p1"}, "take --averages rd");
    refused({"--noise", "diagonal"}, "roots of spectra (--averages sr) have no noise but white");
    for (const char* const option : {"--seed", "--regions"})
        refused({"--labels", data + "/grass.png", option, "2"}, "with --labels there are no clusters");
    refused({"--labels", data + "/grass.png", "--cluster-on", "planes"}, "leave out --labels");
}

TEST(CliIdleOptions, OfRulesForNormals) {
    const TemporaryFolder folder;
    for (const std::string rule : {"ls", "huber", "amb", "ranks:30:80"})
        expect_failure({"relief", "fit", data, "-o", (folder / "relief/").string(), "--robust", rule,
                        "--roughness", ".3"},
                       2, "knows no gloss; leave it out, or take --robust lobe");
}

TEST(CliIdleOptions, OfGrowth) {
    const TemporaryFolder folder;
    const std::string model = (folder / "m.json").string(), compound = (folder / "c.btfm").string(),
                      output = (folder / "t.png").string();
    test::put_model(model);
    expect_failure({"synth", model, "-o", output, "--method", "raster", "--noise-domain", "frequency"}, 2,
                   "--noise-domain: noise of a raster recursion");
    EXPECT_EQ(btfield({"synth", model, "-o", output, "--method", "raster", "--noise-domain", "spatial"}).code,
              0);
    EXPECT_EQ(btfield({"compound", "fit", data + "/grass.png", "-o", compound, "--crop", "0,0,64,64"}).code,
              0);
    expect_failure({"synth", compound, "-o", output, "--noise-domain", "spatial"}, 1,
                   "leave out --noise-domain");
}

TEST(CliIdleOptions, OfTheMostCorrelatedOffsetsAndOfBtfs) {
    const TemporaryFolder folder;
    const std::string output = (folder / "m.json").string();
    for (const Words& command : {Words{"fit", data + "/grass.png"}, Words{"btf", "fit", data}}) {
        Words words = command;
        words.insert(words.end(), {"-o", output, "--neighbourhood", "correlated:6", "--order", "3"});
        expect_failure(words, 2, "--order: ");
    }
}

}  // namespace
}  // namespace btfield
