#include "tests/cli_cases.hpp"
#include "tests/places.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <utility>

#include "btfield/model_file.hpp"

namespace btfield::test {

Ended btfield(Words words, const Surroundings& around) {
    words.insert(words.begin(), test::command_path());
    return run_program(std::move(words), around);
}

std::string text_of(const Words& words) {
    std::string text = "btfield";
    for (const std::string& word : words) text += " " + word;
    return text;
}

std::vector<Words> commands(const Words& parent) {
    std::vector<Words> all{parent};
    Words words = parent;
    words.emplace_back("--help");
    std::istringstream help(btfield(words).out);
    bool listed = false;
    for (std::string line; std::getline(help, line);) {
        if (listed && line.empty()) break;
        if (listed && line[2] != ' ') {
            words.back() = line.substr(2, line.find(' ', 2) - 2);
            const std::vector<Words> below = commands(words);
            all.insert(all.end(), below.begin(), below.end());
        }
        listed = listed || line == "Commands:";
    }
    return all;
}

void expect_failure(const Words& words, int code, const std::string& part, const Surroundings& around) {
    SCOPED_TRACE(text_of(words));
    const Ended ended = btfield(words, around);
    EXPECT_EQ(ended.code, code) << ended.err;
    EXPECT_EQ(ended.out, "");
    // What was to be told of pictures by then comes before.
    std::string error = ended.err;
    while (error.rfind("btfield: warning: ", 0) == 0) error.erase(0, error.find('\n') + 1);
    ASSERT_FALSE(error.empty()) << ended.err;
    EXPECT_EQ(error.rfind("btfield: ", 0), 0U) << ended.err;
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << ended.err;
    EXPECT_EQ(error.back(), '\n');
    EXPECT_NE(error.find(": ", 9), std::string::npos) << ended.err;
    EXPECT_NE(error.find("; "), std::string::npos) << ended.err;
    EXPECT_NE(error.find(part), std::string::npos) << "expected '" << part << "' in: " << ended.err;
}

nlohmann::json expect_object(Words words, const Surroundings& around) {
    SCOPED_TRACE(text_of(words));
    words.emplace_back("--json");
    const Ended ended = btfield(words, around);
    EXPECT_EQ(ended.code, 0) << ended.err;
    EXPECT_EQ(ended.err, "");
    nlohmann::json object = nlohmann::json::parse(ended.out, nullptr, false);
    EXPECT_TRUE(object.is_object()) << ended.out;
    return object;
}

void expect_keys(const nlohmann::json& object, const Words& keys) {
    for (const std::string& key : keys) EXPECT_TRUE(object.contains(key)) << key << " in " << object;
}

void expect_seconds(const nlohmann::json& object, const Words& keys) {
    ASSERT_TRUE(object.contains("seconds"));
    for (const std::string& key : keys) {
        ASSERT_TRUE(object["seconds"].contains(key)) << key;
        EXPECT_GE(object["seconds"][key].get<double>(), 0.0) << key;
    }
}

void expect_model_keys(const nlohmann::json& object) {
    expect_keys(object, {"model", "output", "planes", "size", "marginals", "levels", "parameters", "bytes",
                         "compression_ratio"});
    for (const nlohmann::json& level : object["levels"]) {
        expect_keys(level,
                    {"size", "offsets", "estimator", "gain", "certificate", "log_likelihood", "iterations"});
        expect_keys(level["certificate"], {"valid", "min_singular", "variance_ratio"});
        EXPECT_EQ(level["certificate"]["variance_ratio"].size(), object["planes"].get<std::size_t>());
    }
}

void put_model(const std::filesystem::path& path, const TextureModel& model) {
    write_model(path, model);
}

}  // namespace btfield::test
