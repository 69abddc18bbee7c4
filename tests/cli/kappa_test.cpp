// `btfield kappa` as users' scripts see it.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "btfield/criteria.hpp"
#include "btfield/image_io.hpp"
#include "tests/cli_cases.hpp"
#include "tests/places.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::btfield;
using test::Ended;
using test::expect_failure;
using test::expect_object;

const std::string data = test::data_folder();

TEST(CliKappa, SeveralPictures) {
    const json object = expect_object({"kappa", data + "/cork.png", data + "/cork-xyz.exr"});
    ASSERT_EQ(object["images"].size(), 2U);
    const Kappa expected = kappa(read_picture(data + "/cork.png").image);
    const json& cork = object["images"][0];
    EXPECT_EQ(cork["image"], data + "/cork.png");
    EXPECT_EQ(cork["kappa"].get<double>(), expected.kappa);
    EXPECT_EQ(cork["cmax"], 256.0);
    EXPECT_EQ(cork["verdict"], expected.two_dimensional() ? "2d" : "3d");
    EXPECT_EQ(cork["hdr"], false);
    ASSERT_EQ(cork["covariance"].size(), 3U);
    EXPECT_EQ(cork["covariance"][1][2].get<double>(), expected.covariance[5]);
    EXPECT_EQ(object["images"][1]["hdr"], true);
}

TEST(CliKappa, WhiteLevel) {
    const std::string xyz = data + "/cork-xyz.exr";
    const double turn = expect_object({"kappa", xyz})["images"][0]["white_at_threshold"];
    ASSERT_GT(turn, 0.0);
    const auto verdict = [&](double white) {
        return expect_object({"kappa", xyz, "--white", std::to_string(white)})["images"][0]["verdict"];
    };
    EXPECT_EQ(verdict(0.5 * turn), "3d");
    EXPECT_EQ(verdict(2.0 * turn), "2d");
    // The white level of an 8-bit picture is its own.
    EXPECT_EQ(expect_object({"kappa", data + "/cork.png", "--white", "7"})["images"][0]["white"], 1.0);
    const Ended text = btfield({"kappa", xyz});
    EXPECT_NE(text.out.find("white level 1"), std::string::npos) << text.out;
    EXPECT_EQ(expect_object({"kappa", xyz, "--cmax", "100"})["images"][0]["cmax"], 100.0);
}

TEST(CliKappa, WrongUsageAndRefusals) {
    const std::string cork = data + "/cork.png";
    for (const char* white : {"0", "-1", "nan", "inf", "1x", ""})
        expect_failure({"kappa", cork, "--white", white}, 2, "--white");
    expect_failure({"kappa", cork, "--cmax", "0"}, 2, "--cmax");
    expect_failure({"kappa", cork, "no-such.png"}, 1, "no-such.png");
}

}  // namespace
}  // namespace btfield
