#include "btfield/stop.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <thread>

#include "btfield/error.hpp"
#include "host/base/parallel.hpp"
#include "host/base/stop.hpp"

namespace btfield {

using namespace detail;

namespace {

TEST(StopScopes, EndLoopsInAllTheirThreads) {
    std::atomic<int> runs{0};
    const StopScope scope([&] { return runs >= 10; });
    try {
        for_each_block(10000, [&](int) {
            ++runs;
            for_each_block(2, [](int) {});
        });
        FAIL() << "nothing was thrown";
    } catch (const Stopped& stopped) {
        EXPECT_NE(std::string(stopped.what()).find("StopScope"), std::string::npos) << stopped.what();
    }
    EXPECT_LT(runs.load(), 10 + 64);  // those that had begun
    EXPECT_THROW(stop_if_asked(), Stopped);
}

TEST(StopScopes, OuterOnesCountToo) {
    bool outer = false, inner = false;
    const StopScope first([&] { return outer; });
    {
        const StopScope second([&] { return inner; });
        EXPECT_NO_THROW(stop_if_asked());
        inner = true;
        EXPECT_THROW(stop_if_asked(), Stopped);
        inner = false;
        outer = true;
        EXPECT_THROW(stop_if_asked(), Stopped);
    }
    EXPECT_THROW(stop_if_asked(), Stopped);
    outer = false;
    EXPECT_NO_THROW(stop_if_asked());
}

TEST(StopScopes, LeaveOtherThreadsAlone) {
    const StopScope scope([] { return true; });
    EXPECT_THROW(stop_if_asked(), Stopped);
    std::atomic<int> runs{0};
    std::jthread([&] {
        EXPECT_NO_THROW(stop_if_asked());
        EXPECT_NO_THROW(for_each_block(100, [&](int) { ++runs; }));
    }).join();
    EXPECT_EQ(runs.load(), 100);
}

TEST(StopScopes, EmptyOnesSayNothing) {
    const StopScope scope(nullptr);
    EXPECT_FALSE(scope.asked());
    EXPECT_NO_THROW(stop_if_asked());
}

}  // namespace
}  // namespace btfield
