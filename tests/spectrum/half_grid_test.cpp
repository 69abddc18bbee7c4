#include "host/spectrum/half_grid.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace btfield::detail {
namespace {

TEST(HalfGrid, WeightsAddUpToAllRows) {
    for (int rows = 1; rows <= 20; ++rows) {
        int sum = 0;
        for (int m = 0; m < half_rows(rows); ++m) sum += row_weight(m, rows);
        EXPECT_EQ(sum, rows);
    }
}

TEST(HalfGrid, BlocksHoldEveryRowOnce) {
    for (const int most : {1, 5, 12, 32}) {
        for (int rows = 1; rows <= 200; ++rows) {
            const RowBlocks blocks(rows, most);
            EXPECT_LE(blocks.count, most);
            int next = 0;
            for (int block = 0; block < blocks.count; ++block) {
                EXPECT_EQ(blocks.first(block), next);
                EXPECT_GT(blocks.last(block), next);
                EXPECT_LE(blocks.last(block) - next, blocks.per_block);
                next = blocks.last(block);
            }
            EXPECT_EQ(next, rows);
        }
    }
}

TEST(HalfGrid, RootsOfUnityTurnForAnyMultiple) {
    // The angle is rounded once, the cosine and the sine once each.
    const double tolerance = 8.0 * std::numeric_limits<double>::epsilon();
    for (const int n : {1, 2, 7, 12, 128}) {
        const RootsOfUnity root(n);
        for (long long k = -3LL * n; k <= 3LL * n; ++k) {
            const std::complex<double> expected =
                std::polar(1.0, 2.0 * std::numbers::pi * static_cast<double>(k % n) / n);
            EXPECT_LE(std::abs(root(k) - expected), tolerance);
            EXPECT_EQ(root(k), root(k + n));
        }
    }
}

}  // namespace
}  // namespace btfield::detail
