#pragma once

// The built program in a process of its own, as users' scripts see it.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/example_model.hpp"
#include "tests/run_program.hpp"

namespace btfield::test {

using Words = std::vector<std::string>;

Ended btfield(Words words, const Surroundings& around = {});

std::string text_of(const Words& words);

/// Every command, as its parent's help lists it: {}, {"fit"}, {"experiment"}, {"experiment", "run"}, ...
std::vector<Words> commands(const Words& parent = {});

/// The exit code, nothing on standard output, and one line on standard error that has all three parts.
void expect_failure(const Words& words, int code, const std::string& part, const Surroundings& around = {});

/// Success with exactly one JSON object on standard output and nothing on standard error.
nlohmann::json expect_object(Words words, const Surroundings& around = {});

void expect_keys(const nlohmann::json& object, const Words& keys);

/// Numbers of seconds, none negative.
void expect_seconds(const nlohmann::json& object, const Words& keys);

void expect_model_keys(const nlohmann::json& object);

/// A small model on disk, without a fit.
void put_model(const std::filesystem::path& path,
               const TextureModel& model = example_model(ModelKind::car3d, 3, 2));

}  // namespace btfield::test
