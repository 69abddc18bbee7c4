#include "host/base/parallel.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace btfield {

using namespace detail;

namespace {

TEST(Parallel, RunsEveryBlockOnce) {
    for (const int blocks : {0, 1, 2, 7, 1000}) {
        std::vector<int> runs(static_cast<std::size_t>(blocks));
        for_each_block(blocks, [&](int block) { ++runs[static_cast<std::size_t>(block)]; });
        EXPECT_EQ(std::accumulate(runs.begin(), runs.end(), 0), blocks);
        for (const int count : runs) EXPECT_EQ(count, 1);
    }
}

TEST(Parallel, BlocksShareWorkOutThemselves) {
    constexpr int outer = 9, inner = 11;
    std::vector<int> sums(outer);
    for (int repeat = 0; repeat < 200; ++repeat) {
        std::fill(sums.begin(), sums.end(), 0);
        for_each_block(outer, [&](int block) {
            std::vector<int> parts(inner);
            for_each_block(inner, [&](int part) { parts[static_cast<std::size_t>(part)] = block * part; });
            sums[static_cast<std::size_t>(block)] = std::accumulate(parts.begin(), parts.end(), 0);
        });
        for (int block = 0; block < outer; ++block)
            ASSERT_EQ(sums[static_cast<std::size_t>(block)], block * inner * (inner - 1) / 2);
    }
}

TEST(Parallel, SeveralCallersAtATime) {
    std::atomic<int> total{0};
    {
        std::vector<std::jthread> callers;
        for (int caller = 0; caller < 4; ++caller) {
            callers.emplace_back([&] {
                for (int repeat = 0; repeat < 100; ++repeat) for_each_block(5, [&](int) { ++total; });
            });
        }
    }
    EXPECT_EQ(total.load(), 4 * 100 * 5);
}

TEST(Parallel, PassesOnTheExceptionOfTheLowestBlock) {
    std::atomic<int> runs{0};
    const auto failing = [&](int block) {
        ++runs;
        if (block == 3 || block == 30) throw std::runtime_error(std::to_string(block));
    };
    try {
        for_each_block(40, failing);
        FAIL() << "nothing was thrown";
    } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "3");
    }
    // All end before the caller goes on, unless there is one thread, which stops at the first.
    EXPECT_EQ(runs.load(), std::thread::hardware_concurrency() > 1 ? 40 : 4);
    int after = 0;
    for_each_block(1, [&](int) { ++after; });
    EXPECT_EQ(after, 1);
}

}  // namespace
}  // namespace btfield
