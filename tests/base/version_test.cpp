#include "btfield/version.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "btfield/btfield.hpp"
#include "tests/places.hpp"

namespace btfield {
namespace {

TEST(Version, PartsAreThoseOfTheText) {
    std::ostringstream text;
    text << BTFIELD_VERSION_MAJOR << '.' << BTFIELD_VERSION_MINOR << '.' << BTFIELD_VERSION_PATCH;
    EXPECT_EQ(text.str(), BTFIELD_VERSION);
    EXPECT_EQ(version(), BTFIELD_VERSION);
    EXPECT_EQ(BTFIELD_VERSION_NUMBER,
              BTFIELD_VERSION_MAJOR * 10000 + BTFIELD_VERSION_MINOR * 100 + BTFIELD_VERSION_PATCH);
}

TEST(Version, OneHeaderHasAllOthers) {
    const std::filesystem::path folder = test::source_folder() + "/include/btfield";
    std::ifstream file(folder / "btfield.hpp");
    std::ostringstream content;
    content << file.rdbuf();
    int included = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        if (name == "btfield.hpp" || name == "experiment.hpp") continue;  // a library of its own
        EXPECT_NE(content.str().find("\"btfield/" + name + "\""), std::string::npos) << name;
        ++included;
    }
    EXPECT_GT(included, 15);
}

}  // namespace
}  // namespace btfield
