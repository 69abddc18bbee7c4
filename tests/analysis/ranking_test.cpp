#include "host/analysis/ranking.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

namespace btfield {

using namespace detail;

namespace {

std::vector<float> pixels(std::size_t count, int levels) {
    std::mt19937 generator(11);
    std::normal_distribution<float> normal;
    std::vector<float> values(count);
    for (float& value : values) {
        value = normal(generator);
        if (levels > 0) value = std::round(value * static_cast<float>(levels)) / static_cast<float>(levels);
    }
    return values;
}

TEST(Ranking, KeysOrderAsFloatsDo) {
    const float most = std::numeric_limits<float>::max(), least = std::numeric_limits<float>::denorm_min();
    const std::vector<float> ascending_values = {-most, -2.0F, -1.0F, -least, 0.0F, least, 1.0F, 2.0F, most};
    for (std::size_t k = 0; k < ascending_values.size(); ++k) {
        EXPECT_EQ(sorted_value(sort_key(ascending_values[k])), ascending_values[k]);
        if (k > 0) {
            EXPECT_LT(sort_key(ascending_values[k - 1]), sort_key(ascending_values[k]));
        }
    }
    EXPECT_EQ(sort_key(-0.0F), sort_key(0.0F));
}

TEST(Ranking, SortsEveryPixelOnce) {
    for (const std::size_t count : {1U, 2U, 3U, 1000U, 70001U})
        for (const int levels : {0, 1, 8}) {
            const std::vector<float> values = pixels(count, levels);
            const std::vector<RankedPixel> order = ascending(values, 0);
            ASSERT_EQ(order.size(), count);
            std::vector<int> seen(count);
            for (std::size_t k = 0; k < count; ++k) {
                ASSERT_LT(order[k].place, count);
                ++seen[order[k].place];
                EXPECT_EQ(sorted_value(order[k].key), values[order[k].place]);
                if (k > 0) {
                    ASSERT_LE(sorted_value(order[k - 1].key), sorted_value(order[k].key));
                }
            }
            EXPECT_TRUE(std::ranges::all_of(seen, [](int times) { return times == 1; }));
        }
}

TEST(Ranking, TiesComeInTheSameDisorderEachTime) {
    constexpr std::size_t count = 20000;
    const std::vector<float> values(count, 0.5F);
    const auto places = [&](std::uint32_t stream) {
        std::vector<double> result;
        for (const RankedPixel& pixel : ascending(values, stream)) result.push_back(pixel.place);
        return result;
    };
    EXPECT_EQ(places(0), places(0));
    // Correlation of random permutations: deviation 1/√N; six of them are allowed, to each other, to their
    // own successor, and to the raster order.
    std::vector<double> raster(count);
    std::iota(raster.begin(), raster.end(), 0.0);
    const auto correlation = [&](const std::vector<double>& a, const std::vector<double>& b,
                                 std::size_t lag) {
        const double mean = (count - 1) / 2.0, variance = (static_cast<double>(count) * count - 1.0) / 12.0;
        double sum = 0.0;
        for (std::size_t k = 0; k < count; ++k) sum += (a[k] - mean) * (b[(k + lag) % count] - mean);
        return sum / (count * variance);
    };
    const double bound = 6.0 / std::sqrt(static_cast<double>(count));
    const std::vector<double> first = places(0), second = places(1);
    EXPECT_NEAR(correlation(first, first, 0), 1.0, 1e-12);
    EXPECT_LE(std::abs(correlation(first, second, 0)), bound);
    EXPECT_LE(std::abs(correlation(first, raster, 0)), bound);
    for (const std::size_t lag : {1U, 2U, 3U, 128U})
        EXPECT_LE(std::abs(correlation(first, first, lag)), bound);
}

}  // namespace
}  // namespace btfield
