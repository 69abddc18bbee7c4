// Automatic choices on the command line.

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "btfield/model_file.hpp"
#include "tests/run_program.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::Ended;
using test::TemporaryFolder;
using Words = std::vector<std::string>;

const std::string picture = std::string(BTFIELD_TEST_DATA) + "/sand.png";

Ended btfield(const TemporaryFolder& folder, Words words) {
    words.insert(words.begin(), BTFIELD_CLI);
    return test::run_program(std::move(words), {.folder = folder.path().string()});
}

TEST(SelectionCli, InfoSaysWhatWasChosenAndWhy) {
    const TemporaryFolder folder;
    const Ended fitted = btfield(folder, {"fit", picture, "-o", "m.json", "--crop", "0,0,128,128", "--model",
                                          "auto", "--levels", "auto", "--order", "auto", "--json"});
    ASSERT_EQ(fitted.code, 0) << fitted.err;
    const json object = json::parse(fitted.out);
    ASSERT_EQ(object["reasons"].size(), 3U) << object;
    const auto reason = [&](size_t k) { return object["reasons"][k].get<std::string>(); };
    EXPECT_EQ(reason(0).rfind("model kappa(256) ", 0), 0U) << reason(0);
    EXPECT_NE(reason(0).find(object["model"].get<std::string>() + ": BIC "), std::string::npos) << reason(0);
    EXPECT_EQ(reason(1).rfind(std::to_string(object["levels"].size()) + " level", 0), 0U) << reason(1);
    EXPECT_EQ(reason(2).rfind("order ", 0), 0U) << reason(2);

    const Ended text = btfield(folder, {"info", "m.json"});
    ASSERT_EQ(text.code, 0) << text.err;
    for (size_t k = 0; k < 3; ++k) EXPECT_NE(text.out.find(reason(k)), std::string::npos) << text.out;
    const Ended info = btfield(folder, {"info", "m.json", "--json"});
    ASSERT_EQ(info.code, 0) << info.err;
    EXPECT_EQ(json::parse(info.out)["reasons"], object["reasons"]);
}

TEST(SelectionCli, CorrelatedNeighbourhood) {
    const TemporaryFolder folder;
    const Ended fitted = btfield(folder, {"fit", picture, "-o", "m.json", "--crop", "0,0,128,128",
                                          "--neighbourhood", "correlated:7", "--levels", "2", "--json"});
    ASSERT_EQ(fitted.code, 0) << fitted.err;
    const json object = json::parse(fitted.out);
    for (const json& level : object["levels"]) {
        EXPECT_EQ(level["offsets"], 7);
        EXPECT_EQ(level["neighbourhood"], "custom");
    }
    EXPECT_EQ(object["reasons"].size(), 1U);
    EXPECT_EQ(read_model(folder / "m.json").levels.size(), 2U);
}

TEST(SelectionCli, WrongWords) {
    const TemporaryFolder folder;
    const std::vector<std::pair<Words, std::string>> all{
        {{"--order", "automatic"}, "--order: 'automatic' is neither"},
        {{"--order", "0"}, "--order"},
        {{"--levels", "0"}, "--levels"},
        {{"--levels", "31"}, "--levels"},
        {{"--model", "car"}, "--model: 'car' is none of 2d-car|"},
        {{"--neighbourhood", "custom"}, "--neighbourhood: 'custom' is none of causal|"},
        {{"--neighbourhood", "correlated"}, "correlated:N"},
        {{"--neighbourhood", "correlated:"}, "such as correlated:12"},
        {{"--neighbourhood", "correlated:0"}, "from 1 to 44"},
        {{"--neighbourhood", "correlated:45"}, "from 1 to 44"},
        {{"--neighbourhood", "correlated:4x"}, "from 1 to 44"},
    };
    for (const auto& [words, part] : all) {
        Words whole{"fit", picture, "-o", "m.json"};
        whole.insert(whole.end(), words.begin(), words.end());
        const Ended ended = btfield(folder, whole);
        EXPECT_EQ(ended.code, 2) << ended.err;
        EXPECT_NE(ended.err.find(part), std::string::npos) << ended.err;
        EXPECT_EQ(std::ranges::count(ended.err, '\n'), 1) << ended.err;
    }
    // Known words that do not go together.
    for (const auto& [words, part] : std::vector<std::pair<Words, std::string>>{
             {{"--neighbourhood", "correlated:4", "--order", "auto"}, "take the place of an order"},
             {{"--neighbourhood", "correlated:5", "--model", "3d-mmrf"}, "even number"},
             {{"--neighbourhood", "correlated:23"}, "22 causal offsets"}}) {
        Words whole{"fit", picture, "-o", "m.json"};
        whole.insert(whole.end(), words.begin(), words.end());
        const Ended ended = btfield(folder, whole);
        EXPECT_EQ(ended.code, 1) << ended.err;
        EXPECT_NE(ended.err.find(part), std::string::npos) << ended.err;
    }
    EXPECT_TRUE(folder.names().empty());
}

}  // namespace
}  // namespace btfield
