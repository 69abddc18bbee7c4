// What a configuration may hold, and what is said about one that does not.

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "btfield/error.hpp"
#include "btfield/experiment.hpp"
#include "host/experiment/config_text.hpp"
#include "host/experiment/experiment_names.hpp"
#include "host/experiment/jobs.hpp"
#include "host/experiment/set_pictures.hpp"
#include "host/experiment/sha256.hpp"
#include "tests/experiment_cases.hpp"
#include "tests/json_text.hpp"
#include "tests/places.hpp"

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
    EXPECT_EQ(config.models, std::vector<ExperimentModel>{ExperimentModel::car3d});
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

TEST(ExperimentConfig, SettingsByModel) {
    json document = good();
    document["$schema"] = "experiment.schema.json";
    document["models"] = json::array({"3d-car", "3d-msar", "2d-ma", "compound"});
    document["noise"] = {{"default", "diagonal"},
                         {"car", "full"},
                         {"ma", "full"},
                         {"2d-ma", "diagonal"},
                         {"compound", "full"}};
    document["gains"] = {{"3d-msar", "none"}};
    document["estimators"] = {{"default", json::array({"ls"})}, {"msar", json::array({"ml", "ls"})}};
    document["marginals"] = {{"default", json::array({"none"})}, {"car", json::array({"match"})}};
    const ExperimentConfig config = read(document);
    EXPECT_EQ(noise_of(config, ExperimentModel::car3d), NoiseForm::full);
    EXPECT_EQ(noise_of(config, ExperimentModel::msar3d), NoiseForm::diagonal);
    EXPECT_EQ(noise_of(config, ExperimentModel::ma2d), NoiseForm::diagonal);
    EXPECT_EQ(noise_of(config, ExperimentModel::ma3d), NoiseForm::full);
    EXPECT_EQ(noise_of(config, ExperimentModel::compound), NoiseForm::full);
    EXPECT_EQ(gains_of(config, ExperimentModel::msar3d), GainMode::none);
    EXPECT_EQ(gains_of(config, ExperimentModel::car3d), GainMode::match);
    std::set<std::string> kinds;
    for (const JobSettings& job : job_settings(config)) {
        const json text = test::parsed(settings_text(config, job));
        kinds.insert(text["model"].get<std::string>() + " " + text["noise"].get<std::string>() + " " +
                     text.value("gains", "-") + " " + text["estimator"].get<std::string>() + " " +
                     text["marginals"].get<std::string>());
    }
    EXPECT_EQ(kinds, (std::set<std::string>{"3d-car full match auto match", "3d-msar diagonal none ls none",
                                            "3d-msar diagonal none ml none", "2d-ma diagonal match auto none",
                                            "compound full - auto none"}));
    // A value for all is the same experiment as that value for each: no key changes.
    json plain = good(), split = good();
    plain["noise"] = "full";
    split["noise"] = {{"default", "diagonal"}, {"car", "full"}};
    EXPECT_EQ(settings_text(read(plain), job_settings(read(plain)).front()),
              settings_text(read(split), job_settings(read(split)).front()));
}

TEST(ExperimentConfig, MeasuredValuesAreInTheKeyWhereTheyAreNotStored) {
    json document = good();
    const std::string before = settings_text(read(document), job_settings(read(document)).front());
    document["values"] = "stored";
    EXPECT_EQ(settings_text(read(document), job_settings(read(document)).front()), before);
    document["values"] = "8-bit";
    const ExperimentConfig config = read(document);
    EXPECT_EQ(config.values, MeasuredValues::eight_bit);
    EXPECT_NE(settings_text(config, job_settings(config).front()), before);
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
    expect("/models/0", "Roll", "3d-pmrf, compound, roll");
    expect("/models", json::array({"roll", "3d-car", "roll"}), "models[2] repeats");
    expect("/estimators/0", "best", "estimators[0]");
    expect("/marginals/0", true, "marginals[0]");
    expect("/seeds/0", -1, "seeds[0]");
    expect("/seeds/0", 9223372036854775808U, "seeds[0]");
    expect("/factor", 1, "factor");
    expect("/noise", "some", "noise");
    expect("/gains", 1, "gains");
    expect("/noise", json::object(), "noise is an empty object");
    expect("/noise", {{"4d-car", "full"}}, "noise has the unknown key '4d-car' (known: default, car, ma");
    expect("/noise", {{"roll", "full"}}, "noise has the unknown key 'roll'");
    expect("/noise", {{"car", "half"}}, "noise.car is \"half\"");
    expect("/gains", {{"compound", "none"}}, "gains.compound is not read");
    expect("/estimators", {{"msar", "ls"}}, "estimators.msar is no list");
    expect("/values", "9-bit", "values is \"9-bit\"");
    expect("/$schema", 1, "$schema is no text");
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

json good_btf() {
    json document = good();
    document["pictures"][0] = test::parsed(R"json({
        "material": "m", "btf": "set/", "btf_model": "set.btfm", "coding": "gamma", "colour": "xyz",
        "directions": [{"view": [0, 0], "light": [75.5, -90]}, {"view": [30, 45], "light": [60, 200]}],
        "pixel_stride": 2, "view_stride": 3, "light_stride": 4, "crop": [1, 2, 3, 4]})json");
    return document;
}

TEST(ExperimentConfig, EveryKeyOfABtfArrives) {
    json document = good_btf();
    const ExperimentPictures pictures = read(document).pictures.at(0);
    EXPECT_FALSE(pictures.white.has_value());
    EXPECT_TRUE(pictures.files.empty());
    ASSERT_TRUE(pictures.crop.has_value());
    ASSERT_TRUE(pictures.btf.has_value());
    const ExperimentBtf& btf = *pictures.btf;
    EXPECT_EQ(btf.set, "set/");
    EXPECT_EQ(btf.model, "set.btfm");
    EXPECT_EQ(btf.reading.coding, BtfCoding::gamma);
    EXPECT_EQ(btf.reading.space, ColourSpace::xyz);
    EXPECT_EQ(btf.reading.pixel_stride, 2);
    EXPECT_EQ(btf.reading.view_stride, 3);
    EXPECT_EQ(btf.reading.light_stride, 4);
    ASSERT_EQ(btf.named.size(), 2U);
    EXPECT_EQ(directions_text(btf.named[0]), "view 0,0 light 75.5,270");
    EXPECT_EQ(directions_text(btf.named[1]), "view 30,45 light 60,200");
    document["pictures"][0]["directions"] = {{"number", 30}, {"seed", 7}};
    EXPECT_EQ(read(document).pictures.at(0).btf->number, 30);
    EXPECT_EQ(read(document).pictures.at(0).btf->seed, 7U);
    document["pictures"][0]["directions"] = "all";
    EXPECT_EQ(read(document).pictures.at(0).btf->number, 0);
    EXPECT_TRUE(read(document).pictures.at(0).btf->named.empty());
}

TEST(ExperimentConfig, RefusalsOfBtfsNameThePlace) {
    const auto expect = [](const char* pointer, const json& value, const std::string& part) {
        json document = good_btf();
        document[json::json_pointer(pointer)] = value;
        const std::string said = refusal(document);
        EXPECT_NE(said.find(part), std::string::npos) << pointer << " = " << value << ": " << said;
    };
    expect("/pictures/0/files", json::array({"a.png"}), "pictures[0] has both 'files' and 'btf'");
    expect("/pictures/0/btf", "", "pictures[0].btf is no text");
    expect("/pictures/0/directions", "some", "pictures[0].directions is neither \"all\", nor");
    expect("/pictures/0/directions", {{"seed", 1}}, "pictures[0].directions lacks the key 'number'");
    expect("/pictures/0/directions", {{"number", 0}}, "pictures[0].directions.number is 0");
    expect("/pictures/0/directions/1", {{"view", json::array({0, 0})}},
           "pictures[0].directions[1] lacks the key 'light'");
    expect("/pictures/0/directions/1/view", json::array({90, 0}),
           "directions[1].view is not above the surface");
    expect("/pictures/0/directions/1/view", json::array({30}), "directions[1].view is not [theta, phi]");
    expect("/pictures/0/directions/0", {{"view", json::array({30, 45})}, {"light", json::array({60, 200})}},
           "pictures[0].directions[1] repeats");
    expect("/pictures/0/coding", "best", "pictures[0].coding");
    expect("/pictures/0/pixel_stride", 0, "pictures[0].pixel_stride");
    json document = good_btf();
    document["pictures"][0].erase("directions");
    EXPECT_NE(refusal(document).find("pictures[0] lacks the key 'directions'"), std::string::npos);
    document = good();
    document["pictures"][0]["view_stride"] = 2;
    EXPECT_NE(refusal(document).find("pictures[0].view_stride is read of a 'btf' alone"), std::string::npos);
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
    const json schema = test::parsed(test::bytes_of(test::source_folder() + "/docs/experiment.schema.json"));
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
    for (const auto& known : names_of<ExperimentModel>()) models.emplace(known.word);
    EXPECT_EQ(schema["properties"]["models"]["oneOf"][1]["items"]["enum"].get<std::set<std::string>>(),
              models);
}

/// What docs/p4.md says of its configurations: P4's noise, estimators and 24 attempts for each model.
TEST(ExperimentConfig, ConfigurationsOfP4) {
    const std::string docs = test::source_folder() + "/docs/";
    const ExperimentConfig letter = read_experiment(docs + "p4-table-1.json");
    for (const ExperimentModel model : letter.models) {
        const bool car = model == ExperimentModel::car2d || model == ExperimentModel::car3d;
        EXPECT_EQ(noise_of(letter, model), car ? NoiseForm::full : NoiseForm::diagonal) << name(model);
        EXPECT_EQ(gains_of(letter, model), GainMode::none);
    }
    EXPECT_EQ(letter.estimators, std::vector<EstimatorChoice>{EstimatorChoice::least_squares});
    EXPECT_EQ(letter.marginals, std::vector<MarginalMode>{MarginalMode::none});
    EXPECT_TRUE(letter.allow_invalid);
    const ExperimentConfig improved = read_experiment(docs + "p4-table-1-improved.json");
    EXPECT_FALSE(improved.allow_invalid);
    for (const ExperimentConfig& config : {letter, improved}) {
        EXPECT_EQ(config.values, MeasuredValues::eight_bit);
        EXPECT_EQ(job_settings(config).size(), 10U * 8U * 3U);
        OpenSets sets;
        const std::vector<PictureSource> sources = picture_sources(config, sets);
        EXPECT_EQ(sources.size(), 11U);
        EXPECT_NO_THROW(check_room(
            config, sources, check_pictures(sources, [](const std::string&) -> std::optional<PictureShape> {
                return std::nullopt;
            })));
    }
    EXPECT_EQ(job_settings(read_experiment(docs + "p4-table-1-marginals.json")).size(), 2U * 10U * 3U);
}

std::vector<ExperimentModel> every_model() {
    const auto models = values_of<ExperimentModel>();
    return {models.begin(), models.end()};
}

TEST(ExperimentConfig, CompoundAndRollAreModelsButNotOfAll) {
    json document = good();
    document["models"] = json::array({"roll", "3d-car", "compound"});
    EXPECT_EQ(read(document).models,
              (std::vector<ExperimentModel>{ExperimentModel::roll, ExperimentModel::car3d,
                                            ExperimentModel::compound}));
    document["models"] = "all";
    const std::vector<ExperimentModel> all = read(document).models;
    ASSERT_EQ(all.size(), model_kinds().size());
    for (std::size_t i = 0; i < all.size(); ++i) {
        EXPECT_EQ(all[i], experiment_model(model_kinds()[i]));
        EXPECT_EQ(random_field(all[i]), model_kinds()[i]);
        EXPECT_EQ(name(all[i]), name(model_kinds()[i]));
    }
    EXPECT_EQ(random_field(ExperimentModel::compound), std::nullopt);
    EXPECT_EQ(random_field(ExperimentModel::roll), std::nullopt);
}

/// Else databases would be computed again.
TEST(ExperimentConfig, KeysOfRandomFieldsStay) {
    json document = good();
    document["models"] = "all";
    const ExperimentConfig config = read(document);
    std::string all;
    for (const JobSettings& job : job_settings(config)) all += job_key("picture", settings_text(config, job));
    EXPECT_EQ(settings_text(config, job_settings(config).front()),
              R"({"allow_invalid":true,"estimator":"auto","factor":3,"gains":"none","levels":1,)"
              R"("marginals":"none","metric":"l2","model":"2d-car","noise":"diagonal","order":2,"seed":3,)"
              R"("size":[20,10]})");
    EXPECT_EQ(sha256(all), "bf64c252e2c35444fafa55d362c6bc0223812728f6d7f918e414fd86c574bfa5");
}

TEST(ExperimentConfig, KeysHoldWhatMattersAlone) {
    const auto texts = [](ExperimentModel model, const char* key, const json& value) {
        json document = good();
        document["orders"] = document["levels"] = json::array({1});
        document["marginals"] = json::array({"match"});
        document["seeds"] = json::array({3});
        if (key != nullptr) document[key] = value;
        ExperimentConfig config = read(document);
        config.models = {model};
        std::set<std::string> all;
        for (const JobSettings& job : job_settings(config)) all.insert(settings_text(config, job));
        return all;
    };
    const std::set<std::string> roll = texts(ExperimentModel::roll, nullptr, {}),
                                compound = texts(ExperimentModel::compound, nullptr, {});
    EXPECT_EQ(roll, std::set<std::string>{R"({"metric":"l2","model":"roll","seed":3,"size":[20,10]})"});
    EXPECT_EQ(compound.size(), 1U);
    const std::vector<std::pair<const char*, json>> models_alone{{"orders", json::array({2})},
                                                                 {"levels", json::array({2})},
                                                                 {"marginals", json::array({"none"})},
                                                                 {"factor", 2},
                                                                 {"noise", "full"},
                                                                 {"allow_invalid", false}};
    for (const auto& [key, value] : models_alone) {
        EXPECT_EQ(texts(ExperimentModel::roll, key, value), roll) << key;
        EXPECT_NE(texts(ExperimentModel::compound, key, value), compound) << key;
    }
    const std::vector<std::pair<const char*, json>> neither{{"gains", "match"},
                                                            {"estimators", json::array({"ml", "ls"})}};
    for (const auto& [key, value] : neither) {
        EXPECT_EQ(texts(ExperimentModel::roll, key, value), roll) << key;
        EXPECT_EQ(texts(ExperimentModel::compound, key, value), compound) << key;
    }
    const std::vector<std::pair<const char*, json>> both{
        {"seeds", json::array({4})}, {"metric", "l1"}, {"size", json::array({20, 20})}};
    for (const auto& [key, value] : both) {
        EXPECT_NE(texts(ExperimentModel::roll, key, value), roll) << key;
        EXPECT_NE(texts(ExperimentModel::compound, key, value), compound) << key;
    }
}

TEST(ExperimentConfig, JobsOfOneFitFollowEachOtherAndNoneIsThereTwice) {
    ExperimentConfig config = read(good());
    config.models = every_model();
    const std::vector<JobSettings> jobs = job_settings(config);
    // Each model with each estimator, but for CAR, MA and compound, which have one; a roll and a
    // surface of BTF models for each seed.
    EXPECT_EQ(jobs.size(), (6U * 3U + 5U) * 2U * 2U * 2U * 2U + 4U);
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
    OpenSets sets;
    const std::vector<PictureSource> sources = picture_sources(config, sets);
    ASSERT_EQ(sources.size(), 2U);
    EXPECT_EQ(sources[0].name, "a.ppm");
    EXPECT_EQ(sources[1].name, "b.ppm");
    EXPECT_NE(sources[0].picture, sources[1].picture);
    config.pictures[0].white = 2.0;
    EXPECT_NE(picture_sources(config, sets)[0].picture, sources[0].picture);
    EXPECT_EQ(picture_sources(config, sets)[0].content, sources[0].content);

    config.pictures = {{"m", {"a.ppm", "?.ppm"}, {}, 1.0}};
    EXPECT_THROW(static_cast<void>(picture_sources(config, sets)), InputError);
    config.pictures = {{"m", {"*.png"}, {}, 1.0}};
    EXPECT_THROW(static_cast<void>(picture_sources(config, sets)), InputError);
}

}  // namespace
}  // namespace btfield
