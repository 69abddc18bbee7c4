#include "host/roller/minimum_cut.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <limits>
#include <random>

namespace btfield {

using namespace detail;

namespace {

std::vector<std::int64_t> random_errors(int rows, int columns, unsigned seed) {
    std::mt19937 generator(seed);
    std::vector<std::int64_t> errors(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns));
    for (std::int64_t& error : errors) error = generator() % 100;
    return errors;
}

std::int64_t cost_of(const std::vector<std::int64_t>& errors, int columns, const std::vector<int>& cut) {
    std::int64_t sum = 0;
    for (std::size_t r = 0; r < cut.size(); ++r) {
        const std::size_t at = r * static_cast<std::size_t>(columns) + static_cast<std::size_t>(cut[r]);
        sum += errors[at - 1] + errors[at];
    }
    return sum;
}

/// The definition: every path.
std::int64_t least_cost(const std::vector<std::int64_t>& errors, int rows, int columns, bool closed) {
    std::int64_t least = std::numeric_limits<std::int64_t>::max();
    std::vector<int> cut;
    const std::function<void()> extend = [&] {
        if (static_cast<int>(cut.size()) == rows) {
            if (!closed || std::abs(cut.front() - cut.back()) <= 1)
                least = std::min(least, cost_of(errors, columns, cut));
            return;
        }
        for (int c = 1; c < columns; ++c) {
            if (!cut.empty() && std::abs(cut.back() - c) > 1) continue;
            cut.push_back(c);
            extend();
            cut.pop_back();
        }
    };
    extend();
    return least;
}

void check(int rows, int columns, unsigned seed, bool closed) {
    SCOPED_TRACE(std::to_string(rows) + " rows, " + std::to_string(columns) + " columns, seed " +
                 std::to_string(seed) + (closed ? ", closed" : ""));
    const std::vector<std::int64_t> errors = random_errors(rows, columns, seed);
    const BoundaryCut found = minimum_cut(errors, rows, columns, closed);
    ASSERT_EQ(found.cut.size(), static_cast<std::size_t>(rows));
    for (std::size_t r = 0; r < found.cut.size(); ++r) {
        ASSERT_GE(found.cut[r], 1);
        ASSERT_LT(found.cut[r], columns);
        if (r > 0) {
            ASSERT_LE(std::abs(found.cut[r] - found.cut[r - 1]), 1);
        }
    }
    if (closed) {
        ASSERT_LE(std::abs(found.cut.front() - found.cut.back()), 1);
    }
    EXPECT_EQ(found.cost, cost_of(errors, columns, found.cut));
    EXPECT_EQ(found.cost, least_cost(errors, rows, columns, closed));
}

TEST(MinimumCut, IsTheBestOfAllPaths) {
    for (const int rows : {1, 2, 3, 7})
        for (const int columns : {2, 3, 4, 6})
            for (unsigned seed = 0; seed < 5; ++seed)
                for (const bool closed : {false, true}) check(rows, columns, seed, closed);
}

TEST(MinimumCut, FollowsACrackWhereverItRuns) {
    constexpr int rows = 40, columns = 9;
    std::vector<std::int64_t> errors(rows * columns, 1'000'000);
    std::vector<int> crack;
    for (int r = 0, at = 4; r < rows; ++r) {
        at = std::clamp(at + (r * 7 % 3) - 1, 1, columns - 1);
        crack.push_back(at);
        errors[static_cast<std::size_t>(r * columns + at)] =
            errors[static_cast<std::size_t>(r * columns + at - 1)] = 0;
    }
    EXPECT_EQ(minimum_cut(errors, rows, columns).cost, 0);
}

TEST(MinimumCut, OfEqualPathsIsTheSameEverywhere) {
    const std::vector<std::int64_t> errors(20 * 5, 3);
    EXPECT_EQ(minimum_cut(errors, 20, 5).cut, std::vector<int>(20, 1));
    EXPECT_EQ(minimum_cut(errors, 20, 5, true).cut, std::vector<int>(20, 1));
}

}  // namespace
}  // namespace btfield
