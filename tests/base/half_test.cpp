// host/base/half.cpp.

#include "host/base/half.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace btfield::detail {
namespace {

TEST(Half, ComesBackAndIsRoundedToEven) {
    EXPECT_EQ(float_of_half(0x3c00), 1.0F);
    EXPECT_EQ(float_of_half(0xc100), -2.5F);
    EXPECT_EQ(float_of_half(0x7bff), 65504.0F);
    EXPECT_EQ(float_of_half(0x0001), 0x1p-24F);
    EXPECT_EQ(float_of_half(0x0400), 0x1p-14F);
    EXPECT_TRUE(std::isinf(float_of_half(0x7c00)));
    EXPECT_TRUE(std::isnan(float_of_half(0x7e01)));
    for (unsigned bits = 0; bits < 0x10000U; ++bits) {
        const auto half = static_cast<std::uint16_t>(bits);
        if ((bits & 0x7c00U) == 0x7c00U) continue;
        ASSERT_EQ(half_of_float(float_of_half(half)), half);
        // Half-way to the next: to the even one.
        if ((bits & 0x7fffU) < 0x7bffU) {
            const float next = float_of_half(static_cast<std::uint16_t>(bits + 1U));
            const float middle = 0.5F * (float_of_half(half) + next);
            ASSERT_EQ(half_of_float(middle), bits % 2 == 0 ? bits : bits + 1U);
        }
    }
    EXPECT_EQ(float_of_half(half_of_float(1.0F + 0x1p-11F)), 1.0F);
    EXPECT_EQ(float_of_half(half_of_float(1.0F + 0x1.8p-10F)), 1.0F + 0x1p-9F);
    EXPECT_EQ(half_of_float(65519.0F), 0x7bff);
    EXPECT_EQ(half_of_float(65520.0F), 0x7c00);
    EXPECT_EQ(half_of_float(-1e-9F), 0x8000);
}

}  // namespace
}  // namespace btfield::detail
