// `btfield info` as users' scripts see it.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/cli_cases.hpp"
#include "tests/json_text.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::btfield;
using test::Ended;
using test::Surroundings;
using test::TemporaryFolder;

const std::string picture = test::data_folder() + "/sand.png";

TEST(CliInfo, SaysWhatWasChosenAndWhy) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    const Ended fitted = btfield({"fit", picture, "-o", "m.json", "--crop", "0,0,128,128", "--model", "auto",
                                  "--levels", "auto", "--order", "auto", "--json"},
                                 here);
    ASSERT_EQ(fitted.code, 0) << fitted.err;
    const json object = test::parsed(fitted.out);
    ASSERT_EQ(object["reasons"].size(), 4U) << object;
    const auto reason = [&](size_t k) { return object["reasons"][k].get<std::string>(); };
    EXPECT_EQ(reason(0).rfind("model kappa(256) ", 0), 0U) << reason(0);
    EXPECT_NE(reason(0).find(object["model"].get<std::string>() + ": BIC "), std::string::npos) << reason(0);
    EXPECT_EQ(reason(1).rfind(std::to_string(object["levels"].size()) + " level", 0), 0U) << reason(1);
    EXPECT_EQ(reason(2).rfind("order ", 0), 0U) << reason(2);
    EXPECT_EQ(reason(3).rfind("structure_distance ", 0), 0U) << reason(3);  // grains have shapes

    const Ended text = btfield({"info", "m.json"}, here);
    ASSERT_EQ(text.code, 0) << text.err;
    for (size_t k = 0; k < 4; ++k) EXPECT_NE(text.out.find(reason(k)), std::string::npos) << text.out;
    const Ended info = btfield({"info", "m.json", "--json"}, here);
    ASSERT_EQ(info.code, 0) << info.err;
    EXPECT_EQ(test::parsed(info.out)["reasons"], object["reasons"]);
}

TEST(CliInfo, SeveralModels) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    test::put_model(folder / "a.json");
    test::put_model(folder / "b.json", test::example_model(ModelKind::msar2d, 1, 1));
    const json object = test::expect_object({"info", "a.json", "b.json"}, here);
    ASSERT_EQ(object["models"].size(), 2U);
    EXPECT_EQ(object["models"][0], test::expect_object({"info", "a.json"}, here));
    EXPECT_EQ(object["models"][1]["model"], "2d-msar");
    const Ended text = btfield({"info", "a.json", "b.json"}, here);
    EXPECT_EQ(text.out, btfield({"info", "a.json"}, here).out + "\n" + btfield({"info", "b.json"}, here).out);
    test::expect_failure({"info", "a.json", "c.json"}, 1, "c.json", here);
}

}  // namespace
}  // namespace btfield
