// `btfield version` and `btfield --cite`, as reports of defects and papers take them.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "btfield/version.hpp"
#include "tests/cli_cases.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::btfield;
using test::Ended;
using test::expect_object;

TEST(CliVersion, TellsVersionsAndDevices) {
    const json object = expect_object({"version"});
    EXPECT_EQ(object["version"], BTFIELD_VERSION);
    EXPECT_EQ(object["command_version"], BTFIELD_VERSION);
    EXPECT_TRUE(object["build"]["compiler"].is_string());
    EXPECT_EQ(object["devices"], expect_object({"devices"})["devices"]);
    const Ended plain = btfield({"version"});
    EXPECT_EQ(plain.code, 0);
    EXPECT_EQ(plain.out.rfind("btfield " BTFIELD_VERSION, 0), 0U);
}

TEST(CliVersion, CitationIsThatOfTheRepository) {
    const Ended ended = btfield({"--cite"});
    EXPECT_EQ(ended.code, 0);
    EXPECT_EQ(ended.out.rfind("cff-version: 1.2.0\n", 0), 0U);
    EXPECT_NE(ended.out.find("doi: 10.1007/978-3-642-32436-9_13\n"), std::string::npos);
    EXPECT_EQ(ended.err, "");
}

}  // namespace
}  // namespace btfield
