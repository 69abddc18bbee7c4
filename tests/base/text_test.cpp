#include "host/base/text.hpp"

#include <gtest/gtest.h>

#include <cstdint>

#include "btfield/image.hpp"
#include "btfield/neighbourhood.hpp"

namespace btfield {

using namespace detail;

namespace {

TEST(Text, SizesHaveTheirWidthFirst) {
    EXPECT_EQ(text_of(Size{.height = 256, .width = 320}), "320 x 256");
    EXPECT_EQ(compact_text_of(Size{.height = 256, .width = 320}), "320x256");
    EXPECT_EQ(compact_size_text(std::uint32_t{4294967295}, std::uint32_t{1}), "4294967295x1");
}

TEST(Text, OffsetsHaveTheirRowFirst) {
    EXPECT_EQ(text_of(Offset{.row = -2, .column = 1}), "(-2, 1)");
}

}  // namespace
}  // namespace btfield
