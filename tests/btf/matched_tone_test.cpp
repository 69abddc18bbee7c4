// host/btf/matched_tone.cpp and contrast_code.hpp.

#include "host/btf/matched_tone.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "host/btf/contrast_code.hpp"
#include "tests/plane_statistics.hpp"

namespace btfield {
namespace {

TEST(MatchedTone, MeansAndDeviationsAreMet) {
    std::mt19937 engine(3);
    std::gamma_distribution<float> gamma(2.0F, 0.2F);
    std::vector<float> values(20000);
    for (float& value : values) value = gamma(engine);
    values[5] = 0.0F;
    const test::PlaneStatistics own = test::statistics_of(values);
    const detail::TonedPlane plane(values);
    for (const double contrast : {0.1, 0.5, 0.9, 1.1, 1.8})
        for (const double mean : {0.01, 3.0}) {
            const double deviation = mean * contrast * own.deviation / own.mean;
            std::vector<float> toned = values;
            detail::tone_plane(toned, plane.tone(mean, deviation));
            const test::PlaneStatistics found = test::statistics_of(toned);
            EXPECT_NEAR(found.mean, mean, 0.002 * mean);
            EXPECT_NEAR(found.deviation, deviation, 0.02 * deviation) << contrast;
            EXPECT_GE(std::ranges::min(toned), 0.0F);
            // Brighter stays brighter.
            EXPECT_EQ(values[1] < values[2], toned[1] < toned[2]);
        }
    std::vector<float> toned = values;
    detail::tone_plane(toned, plane.tone(0.5, 0.0));
    EXPECT_TRUE(std::ranges::all_of(toned, [](float v) { return v == 0.5F; }));
    const std::vector<float> flat(100, 0.5F), black(100, 0.0F);
    toned = flat;
    detail::tone_plane(toned, detail::TonedPlane(flat).tone(2.0, 1.0));
    EXPECT_NEAR(toned[50], 2.0F, 1e-5F);
    toned = black;
    detail::tone_plane(toned, detail::TonedPlane(black).tone(2.0, 1.0));
    EXPECT_EQ(toned[50], 0.0F);
}

TEST(ContrastCode, StepsAreSmall) {
    EXPECT_EQ(detail::contrast_code(1.0, 0.0), 0);
    EXPECT_EQ(detail::contrast_code(0.0, 1.0), 0);
    EXPECT_EQ(detail::contrast_of_code(0), 0.0);
    EXPECT_EQ(detail::contrast_code(1.0, 1e9), 255);
    for (double contrast = 0.003; contrast < 10.0; contrast *= 1.0123)
        EXPECT_NEAR(detail::contrast_of_code(detail::contrast_code(0.5, 0.5 * contrast)), contrast,
                    0.0176 * contrast);
}

}  // namespace
}  // namespace btfield
