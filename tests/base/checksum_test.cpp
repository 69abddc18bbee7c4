// host/base/checksum.cpp

#include "host/base/checksum.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string_view>
#include <vector>

namespace btfield::detail {
namespace {

std::uint64_t of_text(std::string_view text) {
    return checksum(std::as_bytes(std::span(text)));
}

TEST(ChecksumSmall, PublishedValues) {
    EXPECT_EQ(of_text(""), 0xef46db3751d8e999U);
    EXPECT_EQ(of_text("a"), 0xd24ec4f1a98c6e5bU);
    EXPECT_EQ(of_text("abc"), 0x44bc2cf5ad770999U);
    // More than 32 bytes, and every kind of rest: 8, 4 and 1 bytes.
    EXPECT_EQ(of_text("Call me Ishmael. Some years ago--never mind how long precisely-"),
              0x02a2e85470d6fd96U);
}

TEST(ChecksumSmall, PiecesAreTheWhole) {
    std::vector<std::byte> bytes(200);
    std::uint32_t state = 3;
    for (std::byte& byte : bytes) {
        state = state * 1664525U + 1013904223U;
        byte = static_cast<std::byte>(state >> 24);
    }
    for (std::size_t size : {std::size_t{5}, std::size_t{32}, std::size_t{64}, bytes.size()}) {
        const std::span<const std::byte> all(bytes.data(), size);
        for (std::size_t step = 1; step <= 70; ++step) {
            Checksum sum;
            for (std::size_t at = 0; at < size; at += step)
                sum.add(all.subspan(at, std::min(step, size - at)));
            EXPECT_EQ(sum.value(), checksum(all)) << size << " " << step;
        }
    }
    // Any bit matters.
    const std::uint64_t before = checksum(bytes);
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
        bytes[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
        EXPECT_NE(checksum(bytes), before);
        bytes[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
    }
}

}  // namespace
}  // namespace btfield::detail
