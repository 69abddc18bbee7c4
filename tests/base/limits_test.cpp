// Numbers of bytes as people write and read them.

#include "host/base/limits.hpp"

#include <gtest/gtest.h>

namespace btfield::detail {
namespace {

TEST(Limits, BytesAsText) {
    EXPECT_EQ(bytes_text(1.0), "1 byte");
    EXPECT_EQ(bytes_text(640.0), "640 bytes");
    EXPECT_EQ(bytes_text(12345.0), "12.3 kB");
    EXPECT_EQ(bytes_text(4e6), "4.0 MB");
    EXPECT_EQ(bytes_text(10.36e9), "10.3 GB");
    EXPECT_EQ(bytes_text(2280.1e9), "2280.1 GB");
}

}  // namespace
}  // namespace btfield::detail
