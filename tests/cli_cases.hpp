#pragma once

// The built program in a process of its own, as users' scripts see it.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "btfield/model_file.hpp"
#include "tests/example_model.hpp"
#include "tests/run_program.hpp"

namespace btfield::test {

using Words = std::vector<std::string>;

inline Ended btfield(Words words, const Surroundings& around = {}) {
    words.insert(words.begin(), BTFIELD_CLI);
    return run_program(std::move(words), around);
}

inline std::string text_of(const Words& words) {
    std::string text = "btfield";
    for (const std::string& word : words) text += " " + word;
    return text;
}

/// Every command, as its parent's help lists it: {}, {"fit"}, {"experiment"}, {"experiment", "run"}, ...
inline std::vector<Words> commands(const Words& parent = {}) {
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

/// The exit code, nothing on standard output, and one line on standard error that has all three parts.
inline void expect_failure(const Words& words, int code, const std::string& part,
                           const Surroundings& around = {}) {
    SCOPED_TRACE(text_of(words));
    const Ended ended = btfield(words, around);
    EXPECT_EQ(ended.code, code) << ended.err;
    EXPECT_EQ(ended.out, "");
    EXPECT_EQ(ended.err.rfind("btfield: ", 0), 0U) << ended.err;
    EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
    EXPECT_EQ(ended.err.back(), '\n');
    EXPECT_NE(ended.err.find(": ", 9), std::string::npos) << ended.err;
    EXPECT_NE(ended.err.find("; "), std::string::npos) << ended.err;
    EXPECT_NE(ended.err.find(part), std::string::npos) << "expected '" << part << "' in: " << ended.err;
}

/// Success with exactly one JSON object on standard output and nothing on standard error.
inline nlohmann::json expect_object(Words words, const Surroundings& around = {}) {
    SCOPED_TRACE(text_of(words));
    words.emplace_back("--json");
    const Ended ended = btfield(words, around);
    EXPECT_EQ(ended.code, 0) << ended.err;
    EXPECT_EQ(ended.err, "");
    nlohmann::json object = nlohmann::json::parse(ended.out, nullptr, false);
    EXPECT_TRUE(object.is_object()) << ended.out;
    return object;
}

inline void expect_keys(const nlohmann::json& object, const Words& keys) {
    for (const std::string& key : keys) EXPECT_TRUE(object.contains(key)) << key << " in " << object;
}

/// Numbers of seconds, none negative.
inline void expect_seconds(const nlohmann::json& object, const Words& keys) {
    ASSERT_TRUE(object.contains("seconds"));
    for (const std::string& key : keys) {
        ASSERT_TRUE(object["seconds"].contains(key)) << key;
        EXPECT_GE(object["seconds"][key].get<double>(), 0.0) << key;
    }
}

inline void expect_model_keys(const nlohmann::json& object) {
    expect_keys(object, {"model", "output", "planes", "size", "marginals", "levels", "parameters", "bytes",
                         "compression_ratio"});
    for (const nlohmann::json& level : object["levels"]) {
        expect_keys(level,
                    {"size", "offsets", "estimator", "gain", "certificate", "log_likelihood", "iterations"});
        expect_keys(level["certificate"], {"valid", "min_singular", "variance_ratio"});
        EXPECT_EQ(level["certificate"]["variance_ratio"].size(), object["planes"].get<std::size_t>());
    }
}

/// A small model on disk, without a fit.
inline void put_model(const std::filesystem::path& path,
                      const TextureModel& model = example_model(ModelKind::car3d, 3, 2)) {
    write_model(path, model);
}

}  // namespace btfield::test
