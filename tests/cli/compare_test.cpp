// `btfield compare` as users' scripts see it.

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/cli_cases.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::expect_object;

const std::string data = test::data_folder();

TEST(CliCompare, APictureWithItself) {
    const std::string picture = data + "/cork.png";
    const json same = expect_object({"compare", picture, picture});
    EXPECT_EQ(same["lag_covariance_error"], 0.0);
    EXPECT_EQ(same["planes"][0]["quantile_error"], 0.0);
    EXPECT_EQ(same["structure_distance"], 0.0);
}

TEST(CliCompare, TellsCurves) {
    const json object = expect_object({"compare", data + "/cork.png", data + "/sand.png"});
    const json& plane = object["planes"][0];
    ASSERT_EQ(plane["covariance"].size(), object["lags"].size());
    EXPECT_EQ(object["lags"][0], json::array({0, 0}));
    EXPECT_EQ(plane["covariance"][0][0], 1.0);
    const double ratio = plane["std_ratio"];
    EXPECT_NEAR(plane["covariance"][0][1].get<double>(), ratio * ratio, 1e-9);
    EXPECT_EQ(plane["spectrum"].size(), object["frequencies"].size());
    EXPECT_EQ(plane["histogram"]["edges"].size(), plane["histogram"]["shares"].size() + 1);
    EXPECT_EQ(object["pictures"], json::array({data + "/cork.png", data + "/sand.png"}));
}

TEST(CliCompare, ListsGiveARowEach) {
    const std::string cork = data + "/cork.png", sand = data + "/sand.png", bark = data + "/bark.png";
    const json object = expect_object({"compare", cork, sand, bark});
    ASSERT_EQ(object["comparisons"].size(), 2U);
    EXPECT_EQ(object["comparisons"][1], expect_object({"compare", cork, bark}));
    const test::Ended text = test::btfield({"compare", cork, sand, bark});
    EXPECT_EQ(text.code, 0) << text.err;
    EXPECT_NE(text.out.find("\n" + sand), std::string::npos) << text.out;
    EXPECT_NE(text.out.find("\n" + bark), std::string::npos) << text.out;
}

TEST(CliCompare, Plots) {
    const test::TemporaryFolder folder;
    const test::Surroundings here{.folder = folder.path().string()};
    const std::string cork = data + "/cork.png", sand = data + "/sand.png";
    for (const char* file : {"c.svg", "c.html"}) {
        const json object = expect_object({"compare", cork, sand, cork, "--plot", file}, here);
        const std::string page = test::bytes_of(folder / file);
        // Two pairs of three planes, three charts each: five frames' worth of paths would be too few.
        std::size_t charts = 0;
        for (std::size_t at = page.find("<g transform"); at != std::string::npos;
             at = page.find("<g transform", at + 1))
            ++charts;
        EXPECT_EQ(charts, 2U * 3U * object["comparisons"][0]["planes"].size());
        EXPECT_NE(page.find("A: " + cork), std::string::npos);
        EXPECT_EQ(page.find("nan"), std::string::npos);
        EXPECT_EQ(page.find("inf"), std::string::npos);
    }
    test::expect_failure({"compare", cork, sand, "--plot", "c.png"}, 2, ".svg", here);
    test::expect_failure({"compare", cork, sand, "--plot", "no/c.svg"}, 1, "does not exist", here);
    test::expect_failure({"compare", cork, "nothing.png", "--plot", "d.svg"}, 1, "nothing.png", here);
    EXPECT_FALSE(std::filesystem::exists(folder / "d.svg"));
}

}  // namespace
}  // namespace btfield
