#include "btfield/model_file.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "tests/example_model.hpp"
#include "tests/full_disk.hpp"
#include "tests/json_text.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::bytes_of;
using test::example_model;
using test::field_of;
using test::put_bytes;
using test::TemporaryFolder;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

std::uint64_t bits(double value) {
    return std::bit_cast<std::uint64_t>(value);
}

void expect_bits(const std::vector<double>& a, const std::vector<double>& b) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(bits(a[i]), bits(b[i])) << i;
}

void expect_same(const LinearField& f, const LinearField& g) {
    EXPECT_EQ(f.planes, g.planes);
    EXPECT_EQ(f.kind, g.kind);
    EXPECT_EQ(f.offsets, g.offsets);
    expect_bits(f.coefficients, g.coefficients);
    EXPECT_EQ(f.active, g.active);
    expect_bits(f.noise_covariance, g.noise_covariance);
}

void expect_same(const TextureModel& a, const TextureModel& b) {
    EXPECT_EQ(a.kind, b.kind);
    EXPECT_EQ(a.size, b.size);
    EXPECT_EQ(a.planes, b.planes);
    EXPECT_EQ(a.space, b.space);
    EXPECT_EQ(a.factor, b.factor);
    EXPECT_EQ(a.noise, b.noise);
    expect_bits(a.mean, b.mean);
    EXPECT_EQ(a.basis.planes, b.basis.planes);
    EXPECT_EQ(a.basis.rank, b.basis.rank);
    expect_bits(a.basis.matrix, b.basis.matrix);
    expect_bits(a.basis.mean, b.basis.mean);
    expect_bits(a.basis.scale, b.basis.scale);
    ASSERT_EQ(a.marginals.size(), b.marginals.size());
    for (std::size_t i = 0; i < a.marginals.size(); ++i)
        expect_bits(a.marginals[i].values, b.marginals[i].values);
    expect_bits(a.whitening, b.whitening);
    EXPECT_EQ(a.provenance.source, b.provenance.source);
    EXPECT_EQ(a.provenance.type, b.provenance.type);
    EXPECT_EQ(a.provenance.picture_bytes, b.provenance.picture_bytes);
    EXPECT_EQ(a.provenance.software, b.provenance.software);
    EXPECT_EQ(a.provenance.reasons, b.provenance.reasons);
    ASSERT_EQ(a.levels.size(), b.levels.size());
    for (std::size_t k = 0; k < a.levels.size(); ++k) {
        const LevelModel &p = a.levels[k], &q = b.levels[k];
        EXPECT_EQ(p.size, q.size);
        ASSERT_EQ(p.models.size(), q.models.size());
        for (std::size_t m = 0; m < p.models.size(); ++m) {
            EXPECT_EQ(p.models[m].index(), q.models[m].index());
            expect_same(linear_field(p.models[m]), linear_field(q.models[m]));
        }
        EXPECT_EQ(bits(p.gain), bits(q.gain));
        EXPECT_EQ(p.estimator, q.estimator);
        EXPECT_EQ(p.iterations, q.iterations);
        EXPECT_EQ(bits(p.log_likelihood), bits(q.log_likelihood));
        EXPECT_EQ(p.certificate.valid, q.certificate.valid);
        EXPECT_EQ(bits(p.certificate.min_singular), bits(q.certificate.min_singular));
        EXPECT_EQ(p.certificate.zeros, q.certificate.zeros);
        expect_bits(p.certificate.variance_ratio, q.certificate.variance_ratio);
    }
}

/// What reading the text complains about; empty when it is accepted.
std::string complaint(const std::string& text) {
    try {
        static_cast<void>(from_json(text));
    } catch (const InputError& error) {
        return error.what();
    }
    return {};
}

void expect_refused(const std::string& text, const std::string& part) {
    const std::string message = complaint(text);
    EXPECT_NE(message.find(part), std::string::npos) << "expected '" << part << "', got '" << message << "'";
    EXPECT_EQ(message.find('\n'), std::string::npos);
}

json example_json() {
    return test::parsed(to_json(example_model()));
}

std::vector<TextureModel> many_models() {
    std::vector<TextureModel> models;
    for (const ModelKind kind : {ModelKind::car3d, ModelKind::msar3d}) {
        for (const int planes : {1, 3, 6}) {
            for (const int levels : {1, 3}) {
                for (const NoiseForm noise : {NoiseForm::full, NoiseForm::diagonal}) {
                    models.push_back(example_model(kind, planes, levels, noise, planes == 3));
                }
            }
        }
    }
    return models;
}

TEST(ModelFile, RoundTripsBitForBit) {
    const TemporaryFolder folder;
    for (const TextureModel& model : many_models()) {
        for (const char* file : {"m.json", "m.btfm", "m.BTFM", "name without extension"}) {
            write_model(folder / file, model);
            expect_same(read_model(folder / file), model);
        }
        expect_same(from_json(to_json(model)), model);
    }
}

TEST(ModelFile, KeepsLimits) {
    TextureModel model = example_model(ModelKind::car3d, 3, 1);
    model.provenance.limits = {{true, false}, {}, {true, true}};
    model.provenance.file_bytes = 129528;
    EXPECT_EQ(from_json(to_json(model)).provenance.file_bytes, 129528U);
    EXPECT_EQ(from_json(to_json(model)).provenance.limits, model.provenance.limits);
    json value = test::parsed(to_json(model));
    EXPECT_EQ(value["provenance"]["limits"], (json{"low", "none", "both"}));
    value["provenance"]["limits"][1] = "some";
    expect_refused(value.dump(), "limits[1]");
    value["provenance"]["limits"] = json{"low"};
    expect_refused(value.dump(), "limits of 1 plane");
}

TEST(ModelFile, KeepsTheScaleOfUnlikePlanes) {
    const TemporaryFolder folder;
    TextureModel model = example_model(ModelKind::car3d, 3, 1, NoiseForm::full, false, true);
    model.basis.scale = {0.1, 634.0, 2e-5};
    for (const char* file : {"m.json", "m.btfm"}) {
        write_model(folder / file, model);
        expect_same(read_model(folder / file), model);
    }
    json value = test::parsed(to_json(model));
    value["basis"]["scale"][1] = -1.0;
    expect_refused(value.dump(), "3 positive numbers");
    value["basis"]["scale"] = json::array({1.0});
    expect_refused(value.dump(), "3 positive numbers");
    value["basis"].erase("scale");
    expect_refused(value.dump(), "basis.scale is missing");
    value["basis"]["scale"] = json::array({1.0, 1.0, 1.0});
    value["basis"]["colour"] = 1;
    expect_refused(value.dump(), "basis.colour");
}

TEST(ModelFile, RoundTripsEveryKindWithAndWithoutMarginals) {
    const TemporaryFolder folder;
    for (const ModelKind kind : model_kinds()) {
        for (const bool marginals : {false, true}) {
            const TextureModel model = example_model(kind, 3, 2, NoiseForm::full, false, marginals);
            write_model(folder / "m.btfm", model);
            expect_same(read_model(folder / "m.btfm"), model);
            expect_same(from_json(to_json(model)), model);
        }
    }
}

TEST(ModelFile, RefusesBasesAndMarginalsThatAreNone) {
    const json good =
        test::parsed(to_json(example_model(ModelKind::car2d, 3, 1, NoiseForm::full, false, true)));
    const auto spoilt = [&](const std::function<void(json&)>& spoil) {
        json value = good;
        spoil(value);
        return complaint(value.dump());
    };
    EXPECT_EQ(spoilt([](json&) {}), "");
    EXPECT_NE(spoilt([](json& v) { v["basis"] = "none"; }), "");
    EXPECT_NE(spoilt([](json& v) { v["basis"][0][0] = 2.0; }).find("orthonormal"), std::string::npos);
    EXPECT_NE(spoilt([](json& v) { v["basis"][0].push_back(0.0); }).find("another length"),
              std::string::npos);
    EXPECT_NE(spoilt([](json& v) { v["basis"].erase(2); }), "");
    EXPECT_NE(spoilt([](json& v) { v["marginals"].erase(2); }).find("marginals"), std::string::npos);
    EXPECT_NE(spoilt([](json& v) { v["marginals"][1][0] = 9.0; }).find("decrease"), std::string::npos);
    EXPECT_NE(spoilt([](json& v) { v["whitening"].push_back(1.0); }).find("whitening"), std::string::npos);
    EXPECT_NE(spoilt([](json& v) { v["levels"][0]["models"].erase(1); }).find("models"), std::string::npos);
}

TEST(ModelFile, RefusesCoefficientsThatAreNotMarkov) {
    for (const ModelKind kind : {ModelKind::mmrf3d, ModelKind::pmrf3d}) {
        json value = test::parsed(to_json(example_model(kind)));
        value["levels"][0]["models"][0]["coefficients"][1] = 0.01;
        expect_refused(value.dump(), "Markov");
    }
}

TEST(ModelFile, RoundTripsExtremeNumbers) {
    TextureModel model = example_model();
    using limits = std::numeric_limits<double>;
    field_of(model, 0).coefficients = {-0.0,
                                       0.0,
                                       limits::min(),
                                       limits::denorm_min(),
                                       limits::max(),
                                       limits::lowest(),
                                       1e300,
                                       0.1,
                                       1.0 / 3.0,
                                       -1.0 - limits::epsilon(),
                                       1e22,
                                       1e23,
                                       1.0,
                                       4503599627370497.5,
                                       9007199254740993.0,
                                       123456789012345678.0};
    model.mean = {-1e-310, 65504.0};
    model.provenance.picture_bytes = std::numeric_limits<std::uint64_t>::max();
    const TemporaryFolder folder;
    for (const char* file : {"m.json", "m.btfm"}) {
        write_model(folder / file, model);
        expect_same(read_model(folder / file), model);
    }
}

TEST(ModelFile, RoundTripsRandomBitPatterns) {
    std::mt19937_64 random(20);
    const TemporaryFolder folder;
    for (int trial = 0; trial < 50; ++trial) {
        TextureModel model = example_model();
        for (double& value : field_of(model, 0).coefficients) {
            do {
                value = std::bit_cast<double>(random());
            } while (!std::isfinite(value));
        }
        expect_same(from_json(to_json(model)), model);
        write_model(folder / "m.btfm", model);
        expect_same(read_model(folder / "m.btfm"), model);
    }
}

TEST(ModelFile, UndefinedNumbersOfAFailedCertificateAreNull) {
    TextureModel model = example_model();
    model.levels[0].certificate = {false, 0.0, 7, {nan, 12.5}};
    model.levels[0].log_likelihood = nan;
    const json level = test::parsed(to_json(model))["levels"][0];
    EXPECT_TRUE(level["log_likelihood"].is_null());
    EXPECT_TRUE(level["certificate"]["variance_ratio"][0].is_null());
    const TemporaryFolder folder;
    for (const char* file : {"m.json", "m.btfm"}) {
        write_model(folder / file, model);
        const TextureModel back = read_model(folder / file);
        EXPECT_TRUE(std::isnan(back.levels[0].log_likelihood));
        EXPECT_TRUE(std::isnan(back.levels[0].certificate.variance_ratio[0]));
        EXPECT_EQ(back.levels[0].certificate.variance_ratio[1], 12.5);
        EXPECT_EQ(back.levels[0].certificate.zeros, 7);
    }
}

TEST(ModelFile, BothFormsHoldTheSameSchema) {
    const TemporaryFolder folder;
    const TextureModel model = example_model(ModelKind::msar3d, 3, 2, NoiseForm::full, true);
    write_model(folder / "m.json", model);
    write_model(folder / "m.btfm", model);
    const std::string text = bytes_of(folder / "m.json"), binary = bytes_of(folder / "m.btfm");
    EXPECT_EQ(test::parsed(text), json::from_cbor(binary));
    EXPECT_LT(binary.size(), text.size());
    EXPECT_EQ(folder.names(), (std::vector<std::string>{"m.btfm", "m.json"}));
}

TEST(ModelFile, ReadsWhicheverFormTheBytesHave) {
    const TemporaryFolder folder;
    const TextureModel model = example_model();
    write_model(folder / "m.btfm", model);
    std::filesystem::rename(folder / "m.btfm", folder / "m.json");
    expect_same(read_model(folder / "m.json"), model);
}

TEST(ModelFile, JsonIsForPeople) {
    const std::string text = to_json(example_model());
    EXPECT_EQ(text.back(), '\n');
    EXPECT_NE(text.find("  \"size\": [50, 37],\n"), std::string::npos) << text;
    EXPECT_NE(text.find("\"offsets\": [[-1, -1], [-1, 0], [-1, 1], [0, -1]],\n"), std::string::npos) << text;
}

TEST(ModelFile, WritesNothingThatItWouldNotRead) {
    const TemporaryFolder folder;
    TextureModel model = example_model();
    model.levels[1].gain = nan;
    EXPECT_THROW(write_model(folder / "m.json", model), InputError);
    EXPECT_THROW(write_model(folder / "m.btfm", model), InputError);
    EXPECT_THROW(static_cast<void>(to_json(model)), InputError);
    EXPECT_TRUE(folder.names().empty());
}

TEST(ModelFile, FullDiskLeavesTheOldModel) {
    const TemporaryFolder folder;
    put_bytes(folder / "m.json", "old");
    {
        const test::FullDisk full(1000);
        EXPECT_THROW(write_model(folder / "m.json", example_model()), InputError);
        EXPECT_THROW(write_model(folder / "m.btfm", example_model()), InputError);
    }
    EXPECT_EQ(bytes_of(folder / "m.json"), "old");
    EXPECT_EQ(folder.names(), std::vector<std::string>{"m.json"});
}

TEST(ModelFile, UnwritablePlacesAreKnownBeforeAnyWork) {
    const TemporaryFolder folder;
    EXPECT_NO_THROW(check_model_writable(folder / "m.json"));
    EXPECT_THROW(check_model_writable(folder / "absent/m.json"), InputError);
    EXPECT_THROW(check_model_writable(folder.path()), InputError);
    EXPECT_THROW(write_model(folder / "absent/m.json", example_model()), InputError);
    EXPECT_TRUE(folder.names().empty());
}

TEST(ModelFile, RefusesFilesThatAreNoModels) {
    const TemporaryFolder folder;
    put_bytes(folder / "empty.json", "");
    put_bytes(folder / "empty.btfm", "");
    put_bytes(folder / "text.json", "It was a dark and stormy night");
    put_bytes(folder / "png.btfm", "\x89PNG\r\n\x1a\n");
    put_bytes(folder / "object.json", "{}");
    put_bytes(folder / "array.json", "[]");
    put_bytes(folder / "blank.json", " \n\t ");
    put_bytes(folder / "object.btfm", "\xA0");
    put_bytes(folder / "nul.json", std::string(100, '\0'));
    for (const std::string& file : folder.names()) {
        EXPECT_THROW(static_cast<void>(read_model(folder / file)), InputError) << file;
    }
    EXPECT_THROW(static_cast<void>(read_model(folder / "absent.json")), InputError);
    EXPECT_THROW(static_cast<void>(read_model(folder.path())), InputError);
    EXPECT_THROW(static_cast<void>(read_model("")), InputError);
}

TEST(ModelFile, RefusesHugeFiles) {
    const TemporaryFolder folder;
    put_bytes(folder / "huge.json", "{");
    std::filesystem::resize_file(folder / "huge.json", std::uintmax_t{1} << 40);  // sparse
    EXPECT_THROW(static_cast<void>(read_model(folder / "huge.json")), InputError);
}

TEST(ModelFile, NewerVersions) {
    json value = example_json();
    value["version"] = {2, 0};
    expect_refused(value.dump(), "newer btfield");
    value["version"] = {0, 9};
    expect_refused(value.dump(), "does not exist");
    value["version"] = {1, -1};
    expect_refused(value.dump(), "does not exist");
    for (const json& wrong : {json(1), json("1.0"), json::array({1}), json::array({1, 0, 0}),
                              json::array({1.0, 0.0}), json(nullptr)}) {
        value["version"] = wrong;
        expect_refused(value.dump(), "version");
    }
    // A later minor version may add keys; this one may not have any that it does not know.
    value["version"] = {1, 2};
    value["added"] = {{"a", 1}};
    value["levels"][0]["added"] = true;
    value["levels"][0]["certificate"]["added"] = 2;
    EXPECT_EQ(complaint(value.dump()), "");
    value["model"] = "5d-unheard-of";
    expect_refused(value.dump(), "newer btfield");
    value["model"] = "3d-car";
    value["version"] = {1, 0};
    expect_refused(value.dump(), "added");
}

TEST(ModelFile, StationsThatAreNotKnown) {
    for (const char* key : {"basis", "marginals"}) {
        json value = example_json();
        ASSERT_EQ(value[key], "none");
        value[key] = "wavelets";
        expect_refused(value.dump(), "newer btfield");
        value[key] = {{"knots", {1, 2, 3}}};
        expect_refused(value.dump(),
                       key == std::string("basis") ? "basis.rows is missing" : "is not an array");
    }
}

/// Visits every value of the document, parents first.
void for_each_path(const json& value, const json::json_pointer& path,
                   const std::function<void(const json::json_pointer&)>& visit) {
    visit(path);
    if (value.is_object()) {
        for (const auto& [key, member] : value.items()) for_each_path(member, path / key, visit);
    } else if (value.is_array()) {
        for (std::size_t i = 0; i < value.size(); ++i) for_each_path(value[i], path / i, visit);
    }
}

TEST(ModelFile, EveryKeyIsNeeded) {
    const json good = example_json();
    std::size_t keys = 0;
    for_each_path(good, json::json_pointer(), [&](const json::json_pointer& path) {
        if (path.empty() || !good.at(path.parent_pointer()).is_object()) return;
        json value = good;
        value.at(path.parent_pointer()).erase(path.back());
        expect_refused(value.dump(), path.back());
        value.at(path.parent_pointer())[path.back() + "x"] = 1;
        EXPECT_NE(complaint(value.dump()), "");
        ++keys;
    });
    EXPECT_EQ(keys, 13U + 5U + 2U * (7U + 4U + 4U));  // top, provenance, levels with models and certificates
}

TEST(ModelFile, EveryTypeIsChecked) {
    const json good = example_json();
    const std::vector<json> others{
        nullptr, true, -1, 1.5, "text", json::array(), json::object(), json::array({json::array()})};
    for_each_path(good, json::json_pointer(), [&](const json::json_pointer& path) {
        const json& old = good.at(path);
        for (const json& other : others) {
            // A number where a number stands, or null where null may stand, is a question of values, not of
            // types.
            if (other.type() == old.type() || (other.is_number() && old.is_number())) continue;
            if (other.is_null() && path.to_string().find("certificate") != std::string::npos) continue;
            json value = good;
            value.at(path) = other;
            EXPECT_NE(complaint(value.dump()), "") << path << " = " << other;
        }
    });
}

TEST(ModelFile, RefusesUnknownNames) {
    for (const char* path : {"/format", "/model", "/colour_space", "/noise", "/provenance/type",
                             "/levels/0/models/0/neighbourhood", "/levels/1/estimator"}) {
        json value = example_json();
        value.at(json::json_pointer(path)) = "never\nheard\x1b[31m of";
        const std::string message = complaint(value.dump());
        EXPECT_NE(message.find("never?heard?[31m of"), std::string::npos) << message;
    }
}

TEST(ModelFile, RefusesWrongNumbers) {
    const auto spoil = [](const char* path, const json& other, const char* part) {
        json value = example_json();
        value.at(json::json_pointer(path)) = other;
        expect_refused(value.dump(), part);
    };
    spoil("/planes", 3, "means");
    spoil("/planes", -1, "planes");
    spoil("/planes", 4294967298, "range");
    spoil("/planes", -4294967294, "range");
    spoil("/planes", 18446744073709551615ULL, "range");
    spoil("/planes", 2147483647, "means");
    spoil("/planes", 2.0, "whole number");
    spoil("/size", {2147483647, 2147483647}, "memory");
    spoil("/size", {0, 5}, "size");
    spoil("/size", {5, -5}, "size");
    spoil("/size", {5}, "two numbers");
    spoil("/factor", 1, "factor");
    spoil("/factor", 3, "level 1");
    spoil("/mean", json::array({0.5}), "1 mean for");
    spoil("/mean/0", nullptr, "mean[0]");
    spoil("/levels", json::array(), "no level");
    spoil("/levels/0/gain", -1.0, "gain");
    spoil("/levels/0/gain", nullptr, "levels[0].gain");
    spoil("/levels/1/models/0/offsets/2", {-1, -1}, "twice");
    spoil("/levels/1/models/0/offsets/2", {0, 0}, "centre");
    spoil("/levels/1/models/0/offsets/2", {1, 0}, "precede");
    spoil("/levels/1/models/0/offsets/2", {-1, 0, 0}, "two numbers");
    spoil("/levels/1/models/0/offsets/2", {-3000000000, 0}, "range");
    spoil("/levels/1/models/0/coefficients", json::array({1.0}), "coefficients");
    spoil("/levels/0/models/0/noise_covariance/0", 0, "positive");
    spoil("/levels/0/models/0/noise_covariance/1", 1, "symmetric");
    spoil("/levels/0/log_likelihood", nullptr, "log-likelihood");
    spoil("/levels/0/certificate/min_singular", nullptr, "singular");
    spoil("/levels/0/certificate/zeros", -1, "zeros");
    spoil("/provenance/picture_bytes", -1, "picture_bytes");
    json per_pair = test::parsed(to_json(example_model(ModelKind::car3d, 2, 1, NoiseForm::full, true)));
    for (const json& wrong : {json::array(), json(nullptr), json::array({1}), json(1)}) {
        json value = per_pair;
        value["levels"][0]["models"][0]["active"] = wrong;
        expect_refused(value.dump(), "active");
    }
    per_pair["levels"][0]["models"][0]["active"][0] = 2;
    expect_refused(per_pair.dump(), "active[0]");
}

TEST(ModelFile, RefusesNumbersBeyondDoubles) {
    std::string text = to_json(example_model());
    const std::string key = "\"gain\": ";
    const std::size_t start = text.find(key) + key.size();
    const std::size_t length = text.find(',', start) - start;
    for (const char* number : {"1e999", "-1e999", "NaN", "Infinity", "nan", "1e", "0x10", "01", "+1", "1,"}) {
        std::string spoilt = text;
        spoilt.replace(start, length, number);
        EXPECT_NE(complaint(spoilt), "") << number;
    }
    text.replace(start, length, "2");  // a whole number is a number
    EXPECT_EQ(complaint(text), "");
}

TEST(ModelFile, RefusesRepeatedKeysAndTrailingText) {
    const std::string text = to_json(example_model());
    std::string twice = text;
    twice.insert(1, "\"planes\": 2,");
    expect_refused(twice, "twice");
    EXPECT_NE(complaint(text + "x"), "");
    EXPECT_NE(complaint(text + text), "");
    EXPECT_EQ(complaint(text + " \n"), "");
}

TEST(ModelFile, DeepNestingDoesNotOverflowTheStack) {
    constexpr std::size_t depth = 2000000;
    expect_refused("{\"a\":" + std::string(depth, '['), "nested");
    std::string objects;
    for (std::size_t i = 0; i < 100000; ++i) objects += "{\"a\":";
    expect_refused(objects, "nested");
    EXPECT_NE(complaint("\xA1\x61"
                        "a" +
                        std::string(depth, '\x81') + "\x01"),
              "");
    EXPECT_NE(complaint("\xA1\x61"
                        "a" +
                        std::string(depth, '\x9F')),
              "");                                                  // arrays of indefinite length
    EXPECT_NE(complaint("\xA1" + std::string(depth, '\x7F')), "");  // strings of indefinite length
    EXPECT_NE(complaint("\xA1\x61"
                        "a" +
                        std::string(depth, '\x5F')),
              "");  // byte strings
    EXPECT_NE(complaint("\xA1\x61"
                        "a" +
                        std::string(depth, '\xC0')),
              "");  // tags
    EXPECT_NE(complaint("\xA1\x61"
                        "a\x9B\x7F" +
                        std::string(7, '\xFF')),
              "");  // an array longer than any file
    EXPECT_NE(complaint("\xBB" + std::string(8, '\xFF') +
                        "\x61"
                        "a"),
              "");
}

TEST(ModelFile, EveryTruncationIsRefused) {
    const TemporaryFolder folder;
    const TextureModel model = example_model(ModelKind::car3d, 1, 1);
    write_model(folder / "m.btfm", model);
    const std::string binary = bytes_of(folder / "m.btfm"), text = to_json(model);
    for (std::size_t length = 0; length < binary.size(); ++length)
        EXPECT_NE(complaint(binary.substr(0, length)), "") << length;
    for (std::size_t length = 0; length + 1 < text.size(); ++length)
        EXPECT_NE(complaint(text.substr(0, length)), "") << length;
    EXPECT_NE(complaint(binary + '\0'), "");
}

/// One random damage to the bytes.
void damage(std::string& bytes, std::mt19937& random) {
    static const std::vector<std::string> pieces{"1e999",
                                                 "-1",
                                                 "null",
                                                 "99999999999999999999",
                                                 "[[[[[[",
                                                 "\"",
                                                 "}",
                                                 "NaN",
                                                 "0.0",
                                                 "\x9F",
                                                 "\x7F",
                                                 "\xFB",
                                                 "\xF9\x7E",
                                                 "\xBB\xFF",
                                                 "{\"a\":",
                                                 ",",
                                                 "\xFF\xFF\xFF\xFF"};
    const auto below = [&](std::size_t end) {
        return std::uniform_int_distribution<std::size_t>(0, end - 1)(random);
    };
    if (bytes.empty()) bytes = "{";
    const std::size_t at = below(bytes.size());
    switch (below(6)) {
        case 0:
            bytes[at] = static_cast<char>(below(256));
            break;
        case 1:
            bytes[at] = static_cast<char>(bytes[at] ^ static_cast<char>(1U << below(8)));
            break;
        case 2:
            bytes.resize(at);
            break;
        case 3:
            bytes.erase(at, 1 + below(20));
            break;
        case 4:
            bytes.insert(at, pieces[below(pieces.size())]);
            break;
        default:
            bytes.insert(at, bytes.substr(below(bytes.size()), 1 + below(40)));
            break;
    }
}

TEST(ModelFile, DamagedFilesYieldACheckedModelOrAnInputError) {
    const TemporaryFolder folder;
    constexpr int rounds = 4000;
    int accepted = 0, refused = 0;
    for (const char* file : {"m.json", "m.btfm"}) {
        write_model(folder / file, example_model(ModelKind::msar3d, 2, 2, NoiseForm::full, true));
        const std::string good = bytes_of(folder / file);
        std::mt19937 random(2024);
        for (int round = 0; round < rounds; ++round) {
            std::string bytes = good;
            for (int n = 0; n <= round % 3; ++n) damage(bytes, random);
            try {
                const TextureModel model = from_json(bytes);
                EXPECT_NO_THROW(check(model)) << round;
                ++accepted;
            } catch (const InputError& error) {
                EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
                ++refused;
            } catch (const std::exception& error) {
                ADD_FAILURE() << file << " round " << round << ": " << error.what();
            }
        }
    }
    // Damage to a digit of a coefficient is a model too; most damage is not.
    EXPECT_GT(accepted, rounds / 50);
    EXPECT_GT(refused, rounds);
}

}  // namespace
}  // namespace btfield
