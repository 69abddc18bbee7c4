// `btfield devices` as users' scripts see it.

#include <gtest/gtest.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/cli_cases.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::btfield;
using test::Ended;
using test::expect_keys;
using test::expect_object;

TEST(CliDevices, ListsAll) {
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

TEST(CliDevices, MeasuresWhatTheyReach) {
    const json object = expect_object({"devices", "--measure"});
    for (const json& device : object["devices"]) {
        // From the slowest machine that runs tests under load to the fastest GPU.
        for (const char* rate : {"copy_bytes_per_second", "operations_per_second"}) {
            EXPECT_GT(device[rate].get<double>(), 1e7) << rate;
            EXPECT_LT(device[rate].get<double>(), 1e16) << rate;
        }
        EXPECT_GT(device["launch_seconds"].get<double>(), 1e-8);
        EXPECT_LT(device["launch_seconds"].get<double>(), 0.1);
    }
    EXPECT_FALSE(expect_object({"devices"})["devices"][0].contains("launch_seconds"));
    const Ended plain = btfield({"devices", "--measure"});
    EXPECT_NE(plain.out.find(" GB/s of copies, "), std::string::npos);
}

}  // namespace
}  // namespace btfield
