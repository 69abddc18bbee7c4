#include "host/roller/leading_planes.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/device_cases.hpp"

namespace btfield {

using namespace detail;

namespace {

/// Planes of one kind that follow the first one but for a part of their own.
Features alike(int planes, float own) {
    const Image random = test::random_image({24, 31}, planes);
    Image image(random.size(), planes, ColourSpace::linear);
    for (int p = 0; p < planes; ++p)
        for (std::size_t i = 0; i < random.plane(0).size(); ++i)
            image.plane(p)[i] =
                static_cast<float>(p + 1) * random.plane(0)[i] + (p > 0 ? own * random.plane(p)[i] : 0.0F);
    return features_of(std::span(&image, 1));
}

double product(const std::vector<float>& a, const std::vector<float>& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += static_cast<double>(a[i]) * static_cast<double>(b[i]);
    return sum;
}

TEST(LeadingPlanes, OneIsEnoughWhereAllAreTheSame) {
    for (const int planes : {2, 3, 8}) {
        const Features features = alike(planes, 0.0F);
        const LeadingPlanes leading(features, 0.01);
        EXPECT_EQ(leading.kept(), 1) << planes << " planes";
        EXPECT_FALSE(leading.all());
    }
}

TEST(LeadingPlanes, KeepsAllThatCounts) {
    const Features apart = alike(3, 1000.0F);
    EXPECT_EQ(LeadingPlanes(apart, 0.01).kept(), 2);  // the first is lost beside the others
    EXPECT_EQ(LeadingPlanes(apart, 0.0).kept(), 3);
    EXPECT_EQ(LeadingPlanes(alike(1, 0.0F), 0.5).kept(), 1);
}

TEST(LeadingPlanes, WhatIsLeftOutIsTheRest) {
    const Features features = alike(4, 0.2F);
    LeadingPlanes leading(features, 0.02);
    ASSERT_LT(leading.kept(), 4);
    while (true) {
        const auto kept = static_cast<std::size_t>(leading.kept());
        std::vector<float> a(kept), b(kept);
        for (int c = 0; c + 1 < features.size.width; ++c) {
            const std::int16_t *first = features.at(3, c), *second = features.at(3, c + 1);
            const double rest_a = leading.turn(first, a.data(), 1),
                         rest_b = leading.turn(second, b.data(), 1);
            double squares = 0.0, expected = 0.0;
            for (int p = 0; p < 4; ++p) {
                squares += static_cast<double>(first[p]) * first[p];
                expected += static_cast<double>(first[p]) * second[p];
            }
            const double rounding = 1e-6 * squares;
            EXPECT_NEAR(product(a, a) + rest_a, squares, rounding);
            const double most = 1e-6 * 4.0 * 1023.0 * 1023.0;
            EXPECT_LE(std::abs(expected - product(a, b)), std::sqrt(rest_a * rest_b) + most);
        }
        if (leading.all()) break;
        leading.keep_one_more();
    }
    leading.keep_one_more();
    EXPECT_EQ(leading.kept(), 4);
}

}  // namespace
}  // namespace btfield
