#include "btfield/error.hpp"

#include <gtest/gtest.h>

#include <string>

namespace btfield {
namespace {

TEST(error, is_one_line_of_three_parts) {
    const InputError error("read 'a.png'", "the file is empty", "give a complete file");
    EXPECT_STREQ(error.what(), "read 'a.png': the file is empty; give a complete file");
    EXPECT_EQ(error.asked(), "read 'a.png'");
    EXPECT_EQ(error.found(), "the file is empty");
    EXPECT_EQ(error.remedy(), "give a complete file");
}

TEST(error, makes_line_breaks_spaces) {
    const InputError error("read 'a\nb.png'", "first\r\nsecond\n", "third\vfourth\f");
    EXPECT_STREQ(error.what(), "read 'a b.png': first  second; third fourth");
    EXPECT_EQ(error.found(), "first  second");
}

TEST(error, is_text_that_a_terminal_shows_and_no_more) {
    const InputError error("read 'a\tb'", std::string("says '\x1b[2J\0\x7f'", 13), "give \xc3\xa4, not \xe4");
    EXPECT_STREQ(error.what(),
                 "read 'a b': says '?[2J?"
                 "?'; give \xc3\xa4, not \xef\xbf\xbd");
}

TEST(error, keeps_the_build_log_apart) {
    const std::string log = "noise.cl:3: error\nnoise.cl:4: error\n";
    const DeviceError error("build 'noise'", "CL_BUILD_PROGRAM_FAILURE", "report it", log);
    EXPECT_EQ(error.log(), log);
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    EXPECT_TRUE(DeviceError("a", "b", "c").log().empty());
}

TEST(error, kinds_are_told_apart) {
    EXPECT_THROW(throw InputError("a", "b", "c"), Error);
    EXPECT_THROW(throw DeviceError("a", "b", "c"), Error);
    try {
        throw DeviceError("a", "b", "c");
    } catch (const InputError&) {
        FAIL() << "a device's failure is not the user's";
    } catch (const Error& error) {
        EXPECT_STREQ(error.what(), "a: b; c");
    }
}

}  // namespace
}  // namespace btfield
