// lay_finer() of host/roller/quilt.cpp.

#include "host/roller/quilt.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

#include "host/roller/block_search.hpp"
#include "host/roller/features.hpp"
#include "tests/device_cases.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

Image halved(const Image& image) {
    Image result({image.height() / 2, image.width() / 2}, image.planes());
    for (int p = 0; p < image.planes(); ++p)
        for (int r = 0; r < result.height(); ++r)
            for (int c = 0; c < result.width(); ++c)
                result.at(p, r, c) = (image.at(p, 2 * r, 2 * c) + image.at(p, 2 * r + 1, 2 * c) +
                                      image.at(p, 2 * r, 2 * c + 1) + image.at(p, 2 * r + 1, 2 * c + 1)) /
                                     4.0F;
    return result;
}

/// Mean squared difference of neighbours on both sides of a cut: what a pixel's right and lower neighbours
/// would have been in the sample, against what they are.
double mean_step(const Features& features, const SourceMap& map) {
    std::int64_t sum = 0, cuts = 0;
    const auto width = static_cast<size_t>(map.size.width);
    for (size_t r = 0; r + 1 < static_cast<size_t>(map.size.height); ++r)
        for (size_t c = 0; c + 1 < width; ++c) {
            const std::uint32_t here = map.source[r * width + c];
            const std::array<std::array<std::uint32_t, 2>, 2> pairs{
                {{map.source[r * width + c + 1], here + 1},
                 {map.source[(r + 1) * width + c], here + static_cast<std::uint32_t>(map.sample.width)}}};
            for (const auto& [is, would_be] : pairs) {
                if (is == would_be || would_be >= area(map.sample)) continue;
                sum += features.distance(is, would_be);
                ++cuts;
            }
        }
    return static_cast<double>(sum) / static_cast<double>(cuts);
}

TEST(Quilt, CutsAreMadeAnewAtAFinerResolution) {
    const std::array<Image, 1> fine{test::mixed_texture({96, 112}, 2, 5)}, coarse{halved(fine.front())};
    const Features of_fine = features_of(fine), of_coarse = features_of(coarse);
    BlockSearch search(test::default_device().impl(), of_coarse);
    QuiltPlan plan;
    const SourceMap quilt = make_quilt(of_coarse, search, {70, 61}, 16, 4, {}, &plan);
    EXPECT_EQ(lay_finer(of_coarse, plan, 1).source, quilt.source);

    const SourceMap map = lay_finer(of_fine, plan, 2);
    EXPECT_EQ(map.size, (Size{140, 122}));
    EXPECT_EQ(map.sample, (Size{96, 112}));
    // The same quilt with each pixel as four: its cuts are among those that the finer ones are the best of.
    SourceMap blocks = map;
    size_t elsewhere = 0;
    for (int r = 0; r < map.size.height; ++r)
        for (int c = 0; c < map.size.width; ++c) {
            const auto at = static_cast<size_t>(r * map.size.width + c);
            const std::uint32_t of = quilt.source[static_cast<size_t>(r / 2 * quilt.size.width + c / 2)];
            const auto row = static_cast<int>(of) / 56, column = static_cast<int>(of) % 56;
            blocks.source[at] = static_cast<std::uint32_t>((2 * row + r % 2) * 112 + 2 * column + c % 2);
            elsewhere += blocks.source[at] != map.source[at] ? 1U : 0U;
        }
    EXPECT_GT(elsewhere, 0U);
    EXPECT_LT(elsewhere, map.source.size() / 4);
    EXPECT_LT(mean_step(of_fine, map), 0.9 * mean_step(of_fine, blocks));
}

}  // namespace
}  // namespace btfield
