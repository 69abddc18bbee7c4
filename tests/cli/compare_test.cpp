// `btfield compare` as users' scripts see it.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/cli_cases.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::expect_object;

const std::string data = BTFIELD_TEST_DATA;

TEST(CliCompare, APictureWithItself) {
    const std::string picture = data + "/cork.png";
    const json same = expect_object({"compare", picture, picture});
    EXPECT_EQ(same["lag_covariance_error"], 0.0);
    EXPECT_EQ(same["planes"][0]["quantile_error"], 0.0);
    EXPECT_EQ(same["structure_distance"], 0.0);
}

}  // namespace
}  // namespace btfield
