#include "btfield/threads.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <set>
#include <string>
#include <thread>

#include "btfield/error.hpp"
#include "host/base/limits.hpp"
#include "host/base/parallel.hpp"

namespace btfield {

using namespace detail;

namespace {

/// Sets the limit while it lives.
class Limit {
  public:
    explicit Limit(int count) { limit_threads(count); }
    ~Limit() { limit_threads(0); }
    Limit(const Limit&) = delete;
    Limit& operator=(const Limit&) = delete;
};

int cores() {
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

/// Blocks that run at a time, at most, in loops inside of loops.
int most_at_a_time() {
    std::atomic<int> now{0}, most{0};
    const auto count = [&](int) {
        const int here = ++now;
        int before = most.load();
        while (before < here && !most.compare_exchange_weak(before, here)) {
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        --now;
    };
    for_each_block(8, [&](int) { for_each_block(8, count); });
    return most.load();
}

TEST(ThreadLimit, IsAllCoresUntilSet) {
    EXPECT_EQ(thread_limit(), cores());
    {
        const Limit limit(1);
        EXPECT_EQ(thread_limit(), 1);
    }
    {
        const Limit limit(1000000);
        EXPECT_EQ(thread_limit(), cores());
    }
    EXPECT_EQ(thread_limit(), cores());
    EXPECT_THROW(limit_threads(-1), InputError);
    EXPECT_EQ(thread_limit(), cores());
}

TEST(ThreadLimit, BoundsWhatWorksAtATime) {
    EXPECT_EQ(most_at_a_time(), cores());
    {
        const Limit limit(1);
        EXPECT_EQ(most_at_a_time(), 1);
        std::set<std::thread::id> ids;
        for_each_block(50, [&](int) { ids.insert(std::this_thread::get_id()); });
        EXPECT_EQ(ids, std::set{std::this_thread::get_id()});
    }
    EXPECT_EQ(most_at_a_time(), cores());
}

TEST(ThreadLimit, BytesAreReadStrictly) {
    EXPECT_EQ(parse_bytes("1"), 1U);
    EXPECT_EQ(parse_bytes("1500000"), 1500000U);
    EXPECT_EQ(parse_bytes("2K"), 2000U);
    EXPECT_EQ(parse_bytes("500M"), 500000000U);
    EXPECT_EQ(parse_bytes("2.5G"), 2500000000U);
    EXPECT_EQ(parse_bytes("2.5GB"), 2500000000U);
    EXPECT_EQ(parse_bytes("1t"), 1000000000000U);
    for (const char* text : {"", "G", "B", "0", "0.0001K", "-1", "1e3", "nan", "inf", "1 G", " 1", "1Gi",
                             "1GG", "99999999999T", "4,5G", "0x10"})
        EXPECT_EQ(parse_bytes(text), std::nullopt) << "'" << text << "'";
}

}  // namespace
}  // namespace btfield
