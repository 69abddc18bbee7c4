#include "host/roller/block_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <limits>

#include "tests/device_cases.hpp"

namespace btfield {

using namespace detail;

namespace {

/// Strips cut out of the sample at `at`, changed a little.
BlockQuery query_at(const Features& features, Size patch, Position at, const Strips& strips, int change) {
    BlockQuery query;
    query.strips = strips;
    query.key = 7;
    for (int r = 0; r < patch.height; ++r)
        for (int c = 0; c < patch.width; ++c) {
            const bool known = r < strips.top || r >= patch.height - strips.bottom || c < strips.left ||
                               c >= patch.width - strips.right;
            for (int p = 0; p < features.planes; ++p)
                query.known.push_back(
                    static_cast<std::int16_t>(known ? std::clamp(features.at(at.row + r, at.column + c)[p] +
                                                                     change * ((r + c + p) % 3 - 1),
                                                                 -1023, 1023)
                                                    : 0));
        }
    return query;
}

/// The definition.
std::int64_t difference(const Features& features, const BlockQuery& query, Size patch, Position at) {
    std::int64_t sum = 0;
    for (int r = 0; r < patch.height; ++r)
        for (int c = 0; c < patch.width; ++c) {
            const Strips& s = query.strips;
            if (r >= s.top && r < patch.height - s.bottom && c >= s.left && c < patch.width - s.right)
                continue;
            for (int p = 0; p < features.planes; ++p) {
                const std::int64_t d =
                    query.known[static_cast<std::size_t>((r * patch.width + c) * features.planes + p)] -
                    features.at(at.row + r, at.column + c)[p];
                sum += d * d;
            }
        }
    return sum;
}

std::vector<std::int64_t> all_differences(const Features& features, const BlockQuery& query, Size patch,
                                          int radius) {
    std::vector<std::int64_t> result;
    for (int r = 0; r + patch.height <= features.size.height; ++r)
        for (int c = 0; c + patch.width <= features.size.width; ++c) {
            const bool excluded = std::any_of(query.excluded.begin(), query.excluded.end(), [&](Position at) {
                return std::abs(at.row - r) < radius && std::abs(at.column - c) < radius;
            });
            result.push_back(excluded ? std::numeric_limits<std::int64_t>::max()
                                      : difference(features, query, patch, {r, c}));
        }
    return result;
}

Features features(Size size, int planes) {
    const Image image = test::mixed_texture(size, planes, 3);
    return features_of(std::span(&image, 1));
}

/// Position of the least among those that are not excluded, weights 1.
std::size_t position_of_least(const Features& sample, const BlockQuery& query, Size patch, int radius) {
    const std::vector<std::int64_t> all = all_differences(sample, query, patch, radius);
    return static_cast<std::size_t>(std::min_element(all.begin(), all.end()) - all.begin());
}

class BlockSearchSmall : public testing::TestWithParam<int> {
  protected:
    Device device_ = test::device_of_width(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Widths, BlockSearchSmall, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(BlockSearchSmall, FindsTheLeast) {
    const Features sample = features({19, 23}, 2);
    BlockSearch search(device_.impl(), sample);
    const Size patch{8, 6};
    const BlockQuery query = query_at(sample, patch, {5, 9}, {2, 2, 0, 0}, 1);
    const Position found = search.find({&query, 1}, patch, 1, 0.0).front();
    const std::vector<std::int64_t> all = all_differences(sample, query, patch, 1);
    EXPECT_EQ(difference(sample, query, patch, found), *std::min_element(all.begin(), all.end()));
}

class BlockSearchWidths : public BlockSearchSmall {};
INSTANTIATE_TEST_SUITE_P(Widths, BlockSearchWidths, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(BlockSearchWidths, ChoosesWithinTheTolerance) {
    for (const int planes : test::plane_counts) {
        const Features sample = features({47, 61}, planes);  // a lattice of 48 x 63 beside it
        BlockSearch search(device_.impl(), sample);
        const Size patch{16, 13};
        std::vector<BlockQuery> queries;
        for (const Strips& strips : {Strips{0, 4, 0, 0}, Strips{4, 0, 0, 0}, Strips{4, 4, 0, 0},
                                     Strips{3, 4, 3, 4}, Strips{8, 0, 8, 0}, Strips{1, 0, 0, 1}})
            for (const Position at : {Position{3, 7}, Position{31, 48}}) {
                queries.push_back(query_at(sample, patch, at, strips, 40));
                queries.back().key = queries.size();
                if (queries.size() % 2 == 0) queries.back().excluded = {at, {0, 0}, {-3, 60}};
            }
        const int radius = 3;
        const std::vector<Position> found = search.find(queries, patch, radius, 0.3);
        for (std::size_t i = 0; i < queries.size(); ++i) {
            const std::vector<std::int64_t> all = all_differences(sample, queries[i], patch, radius);
            const std::int64_t least = *std::min_element(all.begin(), all.end());
            const std::int64_t most = least + static_cast<std::int64_t>(0.3 * static_cast<double>(least));
            // The one of them that the key puts first.
            std::size_t expected = all.size();
            for (std::size_t k = 0; k < all.size(); ++k)
                if (all[k] <= most &&
                    (expected == all.size() || draw(queries[i].key, k) < draw(queries[i].key, expected)))
                    expected = k;
            const auto columns = static_cast<std::size_t>(sample.size.width - patch.width + 1);
            EXPECT_EQ(
                static_cast<std::size_t>(found[i].row) * columns + static_cast<std::size_t>(found[i].column),
                expected)
                << "query " << i << ", " << planes << " planes";
        }
    }
}

TEST(BlockSearch, FewerPlanesChooseTheSame) {
    for (const float own : {0.0F, 0.3F}) {
        Image image = test::mixed_texture({61, 70}, 3, 3);
        for (std::size_t i = 0; i < image.plane(0).size(); ++i) {
            image.plane(1)[i] = image.plane(0)[i] + own * image.plane(1)[i];
            image.plane(2)[i] = image.plane(0)[i] - own * image.plane(2)[i];
        }
        const Features sample = features_of(std::span(&image, 1));
        Device device;
        BlockSearch search(device.impl(), sample);
        ASSERT_LT(search.correlated_planes(), 3);
        const Size patch{16, 13};
        std::vector<BlockQuery> queries;
        for (const Strips& strips : {Strips{0, 4, 0, 0}, Strips{4, 4, 0, 0}, Strips{3, 4, 3, 4}})
            for (const Position at : {Position{3, 7}, Position{30, 48}, Position{45, 1}}) {
                queries.push_back(query_at(sample, patch, at, strips, 60));
                queries.back().excluded = {at};
            }
        const int radius = 4;
        const std::vector<Position> found = search.find(queries, patch, radius, 0.0);
        for (std::size_t i = 0; i < found.size(); ++i)
            EXPECT_EQ(static_cast<std::size_t>(found[i].row * (70 - 13 + 1) + found[i].column),
                      position_of_least(sample, queries[i], patch, radius))
                << "query " << i << ", own part " << own;
    }
}

TEST(BlockSearch, CorrelatesMorePlanesWhereFewTellTooLittle) {
    // The second plane holds little, but most of what there is outside of a corner.
    const Image noise = test::random_image({96, 80}, 1);
    Image image(noise.size(), 2, ColourSpace::linear);
    for (int r = 0; r < 96; ++r)
        for (int c = 0; c < 80; ++c) {
            image.at(0, r, c) = r < 40 && c < 40 ? (r / 2 + c / 3) % 2 == 0 ? 1.0F : -1.0F : 0.0F;
            image.at(1, r, c) = 0.05F * noise.at(0, r, c);
        }
    const Features sample = features_of(std::span(&image, 1));
    Device device;
    BlockSearch search(device.impl(), sample);
    ASSERT_EQ(search.correlated_planes(), 1);
    const Size patch{12, 12};
    std::vector<BlockQuery> queries;
    for (int i = 0; i < 20; ++i) {
        queries.push_back(query_at(sample, patch, {45 + i, 3 * i}, {3, 3, 0, 0}, 9));
        if (i % 2 == 0) queries.back().excluded = {{45 + i, 3 * i}};
    }
    for (int again = 0; again < 2; ++again) {
        const std::vector<Position> found = search.find(queries, patch, 3, 0.0);
        for (std::size_t i = 0; i < found.size(); ++i)
            EXPECT_EQ(static_cast<std::size_t>(found[i].row * (80 - 12 + 1) + found[i].column),
                      position_of_least(sample, queries[i], patch, 3))
                << "query " << i;
        EXPECT_EQ(search.correlated_planes(), 2);
    }
}

TEST(BlockSearch, WeightsCount) {
    const Features sample = features({40, 52}, 3);
    Device device;
    BlockSearch search(device.impl(), sample);
    const Size patch{12, 10};
    const BlockQuery query = query_at(sample, patch, {8, 30}, {3, 3, 0, 3}, 60);
    const std::vector<std::int64_t> all = all_differences(sample, query, patch, 1);
    PositionWeights weights;
    for (std::size_t i = 0; i < all.size(); ++i)
        weights.values.push_back(i == 8 * 43 + 30 ? 1e4F : static_cast<float>(1 + i * i % 50));
    weights.largest = 1e4F;
    std::size_t expected = 0;
    const auto weighted = [&](std::size_t i) {
        return static_cast<double>(weights.values[i]) * static_cast<double>(all[i]);
    };
    for (std::size_t i = 0; i < all.size(); ++i)
        if (weighted(i) < weighted(expected)) expected = i;
    const Position found = search.find({&query, 1}, patch, 1, 0.0, &weights).front();
    EXPECT_EQ(static_cast<std::size_t>(found.row * (52 - 10 + 1) + found.column), expected);
    EXPECT_NE(found, search.find({&query, 1}, patch, 1, 0.0).front());
}

TEST(BlockSearch, ClFftChoosesTheSame) {
    const Features sample = features({40, 64}, 3);
    const Size patch{12, 12};
    const BlockQuery query = query_at(sample, patch, {8, 30}, {3, 3, 0, 3}, 60);
    Device lanes = test::device_of_width(0), clfft = test::device_of_width(0, FftBackend::clfft);
    EXPECT_EQ(BlockSearch(lanes.impl(), sample).find({&query, 1}, patch, 2, 0.5),
              BlockSearch(clfft.impl(), sample).find({&query, 1}, patch, 2, 0.5));
}

TEST(BlockSearch, TakesWhatIsExcludedWhereNothingElseIsLeft) {
    const Features sample = features({20, 20}, 1);
    Device device;
    BlockSearch search(device.impl(), sample);
    const Size patch{18, 18};
    BlockQuery query = query_at(sample, patch, {1, 2}, {4, 4, 0, 0}, 0);
    query.excluded = {{1, 1}};
    const Position found = search.find({&query, 1}, patch, 5, 0.0).front();
    EXPECT_EQ(found, (Position{1, 2}));
}

TEST(BlockSearch, DrawsAmongEquals) {
    // Two colours in large areas: thousands of positions fit exactly.
    Image image({64, 64}, 1);
    for (int r = 0; r < 64; ++r)
        for (int c = 0; c < 64; ++c) image.at(0, r, c) = c < 32 ? 0.0F : 1.0F;
    const Features sample = features_of(std::span(&image, 1));
    Device device;
    BlockSearch search(device.impl(), sample);
    const Size patch{8, 8};
    std::vector<BlockQuery> queries(16, query_at(sample, patch, {20, 5}, {2, 2, 0, 0}, 0));
    for (std::size_t i = 0; i < queries.size(); ++i) queries[i].key = i;
    const std::vector<Position> found = search.find(queries, patch, 2, 0.1);
    for (std::size_t i = 0; i < found.size(); ++i) {
        EXPECT_EQ(difference(sample, queries[i], patch, found[i]), 0);
        EXPECT_EQ(std::count(found.begin(), found.end(), found[i]), 1) << "key " << i;
    }
}

}  // namespace
}  // namespace btfield
