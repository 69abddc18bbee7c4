// What a configuration may hold, and what is said about one that does not.

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "btfield/error.hpp"
#include "btfield/experiment.hpp"
#include "host/experiment/config_text.hpp"
#include "host/experiment/jobs.hpp"
#include "tests/experiment_cases.hpp"
#include "tests/json_text.hpp"

namespace btfield {

using namespace detail;

namespace {

using nlohmann::json;
using test::put_bytes;
using test::TemporaryFolder;

json good() {
    return test::parsed(R"json({
        "name": "n", "pictures": [{"material": "m", "files": ["*.ppm"], "crop": [1, 2, 3, 4], "white": 2.5}],
        "models": ["3d-car"], "orders": [2, 1], "levels": [1, 0], "estimators": ["ls", "auto", "ml"],
        "marginals": ["none", "match"], "seeds": [3, 9223372036854775807], "factor": 3, "noise": "diagonal",
        "gains": "none", "metric": "l2", "size": [20, 10], "allow_invalid": true})json");
}

ExperimentConfig read(const json& document) {
    return experiment_from_text(document.dump(), "/folder", "read it");
}

std::string refusal(const json& document) {
    try {
        static_cast<void>(read(document));
    } catch (const InputError& error) {
        return error.what();
    }
    return "accepted";
}

TEST(ExperimentConfig, EveryKeyArrives) {
    const ExperimentConfig config = read(good());
    EXPECT_EQ(config.name, "n");
    ASSERT_EQ(config.pictures.size(), 1U);
    EXPECT_EQ(config.pictures[0].material, "m");
    EXPECT_EQ(config.pictures[0].files, std::vector<std::string>{"*.ppm"});
    ASSERT_TRUE(config.pictures[0].crop.has_value());
    EXPECT_EQ(crop_text(config.pictures[0].crop), "1,2,3,4");
    EXPECT_EQ(config.pictures[0].white, 2.5);
    EXPECT_EQ(config.models, std::vector<ModelKind>{ModelKind::car3d});
    EXPECT_EQ(config.orders, (std::vector<int>{2, 1}));
    EXPECT_EQ(config.levels, (std::vector<int>{1, 0}));
    EXPECT_EQ(config.estimators,
              (std::vector<EstimatorChoice>{EstimatorChoice::least_squares, EstimatorChoice::automatic,
                                            EstimatorChoice::maximum_likelihood}));
    EXPECT_EQ(config.marginals, (std::vector<MarginalMode>{MarginalMode::none, MarginalMode::match}));
    EXPECT_EQ(config.seeds, (std::vector<std::uint64_t>{3, 9223372036854775807U}));
    EXPECT_EQ(config.factor, 3);
    EXPECT_EQ(config.noise, NoiseForm::diagonal);
    EXPECT_EQ(config.gains, GainMode::none);
    EXPECT_EQ(config.metric, Metric::l2);
    EXPECT_EQ(config.size, (Size{10, 20}));
    EXPECT_TRUE(config.allow_invalid);
}

TEST(ExperimentConfig, RefusalsNameThePlace) {
    const auto expect = [](const char* pointer, const json& value, const std::string& part) {
        json document = good();
        document[json::json_pointer(pointer)] = value;
        const std::string said = refusal(document);
        EXPECT_NE(said.find(part), std::string::npos) << pointer << " = " << value << ": " << said;
    };
    expect("/order", 1, "unknown key 'order'");
    expect("/pictures/0/whit", 1, "pictures[0] has the unknown key 'whit'");
    expect("/orders/1", 9, "orders[1] is 9, not a whole number from 1 to 8");
    expect("/orders/1", 2, "orders[1] repeats");
    expect("/orders", json::array(), "orders is no list");
    expect("/orders/0", 1.5, "orders[0]");
    expect("/levels/0", -1, "levels[0]");
    expect("/models", "none", "models is no list");
    expect("/models/0", "4d-car", "models[0] is \"4d-car\", none of 2d-car");
    expect("/estimators/0", "best", "estimators[0]");
    expect("/marginals/0", true, "marginals[0]");
    expect("/seeds/0", -1, "seeds[0]");
    expect("/seeds/0", 9223372036854775808U, "seeds[0]");
    expect("/factor", 1, "factor");
    expect("/noise", "some", "noise");
    expect("/gains", 1, "gains");
    expect("/metric", "l3", "metric");
    expect("/size", json::array({1}), "size is not [width, height]");
    expect("/size/0", 0, "size[0]");
    expect("/allow_invalid", 1, "allow_invalid is neither true nor false");
    expect("/name", "", "name is no text");
    expect("/pictures", json::object(), "pictures is no list");
    expect("/pictures/0/crop", json::array({1, 2, 3}), "pictures[0].crop is not");
    expect("/pictures/0/crop/2", 0, "pictures[0].crop[2]");
    expect("/pictures/0/white", 0.0, "pictures[0].white");
    expect("/pictures/0/files", "a.png", "pictures[0].files is no list");
}

TEST(ExperimentConfig, KeysThatMustBeThere) {
    for (const char* key : {"pictures", "models", "orders", "levels"}) {
        json document = good();
        document.erase(key);
        EXPECT_NE(refusal(document).find("lacks the key '" + std::string(key) + "'"), std::string::npos)
            << key;
    }
    for (const char* key : {"material", "files"}) {
        json document = good();
        document["pictures"][0].erase(key);
        EXPECT_NE(refusal(document).find("pictures[0] lacks the key '" + std::string(key) + "'"),
                  std::string::npos);
    }
    json least = good();
    for (const char* key : {"name", "estimators", "marginals", "seeds", "factor", "noise", "gains", "metric",
                            "size", "allow_invalid"}) {
        least.erase(key);
    }
    EXPECT_EQ(refusal(least), "accepted");
}

TEST(ExperimentConfig, NoJson) {
    const TemporaryFolder folder;
    put_bytes(folder / "empty.json", "");
    put_bytes(folder / "twice.json", R"({"orders": [1], "orders": [2]})");
    put_bytes(folder / "broken.json", R"({"orders": [1)");
    EXPECT_THROW(static_cast<void>(read_experiment(folder / "empty.json")), InputError);
    EXPECT_THROW(static_cast<void>(read_experiment(folder / "twice.json")), InputError);
    EXPECT_THROW(static_cast<void>(read_experiment(folder / "broken.json")), InputError);
    EXPECT_THROW(static_cast<void>(read_experiment(folder / "absent.json")), InputError);
    EXPECT_THROW(static_cast<void>(read_experiment(folder.path())), InputError);
}

/// The published schema and the reader know the same keys: the reader lists its own when it meets another.
TEST(ExperimentConfig, SchemaFileAgrees) {
    const json schema = test::parsed(test::bytes_of(BTFIELD_SOURCE_DIR "/docs/experiment.schema.json"));
    const auto keys_of_reader = [](const json& document) {
        const std::string said = refusal(document);
        const std::string start = "(known: ";
        std::set<std::string> keys;
        std::size_t at = said.find(start) + start.size();
        const std::size_t end = said.find(')', at);
        while (at < end) {
            const std::size_t comma = std::min(said.find(", ", at), end);
            keys.insert(said.substr(at, comma - at));
            at = comma + 2;
        }
        return keys;
    };
    const auto keys_of_schema = [](const json& object) {
        std::set<std::string> keys;
        for (const auto& item : object.at("properties").items()) keys.insert(item.key());
        return keys;
    };
    json document = good();
    document["?"] = 1;
    EXPECT_EQ(keys_of_reader(document), keys_of_schema(schema));
    document = good();
    document["pictures"][0]["?"] = 1;
    EXPECT_EQ(keys_of_reader(document), keys_of_schema(schema["properties"]["pictures"]["items"]));
    std::set<std::string> models;
    for (const ModelKind kind : model_kinds()) models.emplace(name(kind));
    EXPECT_EQ(schema["properties"]["models"]["oneOf"][1]["items"]["enum"].get<std::set<std::string>>(),
              models);
}

TEST(ExperimentConfig, JobsOfOneFitFollowEachOtherAndNoneIsThereTwice) {
    ExperimentConfig config = read(good());
    config.models = {model_kinds().begin(), model_kinds().end()};
    const std::vector<JobSettings> jobs = job_settings(config);
    // Each model with each estimator, but for CAR and MA, which have one.
    EXPECT_EQ(jobs.size(), (6U * 3U + 4U) * 2U * 2U * 2U * 2U);
    std::set<std::string> texts;
    for (std::size_t i = 0; i < jobs.size(); ++i) {
        EXPECT_TRUE(texts.insert(settings_text(config, jobs[i])).second);
        if (i % 2 == 1) {
            EXPECT_TRUE(same_fit(jobs[i - 1], jobs[i]));
        }
        if (i > 0 && jobs[i - 1].marginals == jobs[i].marginals) {
            EXPECT_GE(jobs[i - 1].order, jobs[i].order);
        }
    }
}

TEST(ExperimentConfig, PicturesArePatternsOfTheFolder) {
    const TemporaryFolder folder;
    std::filesystem::create_directories(folder / "odd [1]*");
    test::write_texture(folder / "odd [1]*/b.ppm", 1);
    test::write_texture(folder / "odd [1]*/a.ppm", 2);
    ExperimentConfig config = read(good());
    config.folder = folder / "odd [1]*";
    config.pictures = {{"m", {"?.ppm"}, {}, 1.0}};
    const std::vector<PictureSource> sources = picture_sources(config);
    ASSERT_EQ(sources.size(), 2U);
    EXPECT_EQ(sources[0].name, "a.ppm");
    EXPECT_EQ(sources[1].name, "b.ppm");
    EXPECT_NE(sources[0].picture, sources[1].picture);
    config.pictures[0].white = 2.0;
    EXPECT_NE(picture_sources(config)[0].picture, sources[0].picture);
    EXPECT_EQ(picture_sources(config)[0].content, sources[0].content);

    config.pictures = {{"m", {"a.ppm", "?.ppm"}, {}, 1.0}};
    EXPECT_THROW(static_cast<void>(picture_sources(config)), InputError);
    config.pictures = {{"m", {"*.png"}, {}, 1.0}};
    EXPECT_THROW(static_cast<void>(picture_sources(config)), InputError);
}

}  // namespace
}  // namespace btfield
