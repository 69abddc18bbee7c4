#include "btfield/curves.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <random>

#include "btfield/error.hpp"
#include "tests/device_cases.hpp"
#include "tests/reference/lag_covariance.hpp"

namespace btfield {
namespace {

Image white(Size size, float deviation, unsigned seed) {
    Image image(size, 1);
    std::mt19937 random(seed);
    std::normal_distribution<float> normal(5.0F, deviation);
    for (float& v : image.values()) v = normal(random);
    return image;
}

TEST(StatisticCurves, OfWhiteNoiseAreFlat) {
    const StatisticCurves curves = statistic_curves(white({256, 200}, 1.0F, 1), white({180, 256}, 2.0F, 2));
    ASSERT_EQ(curves.planes.size(), 1U);
    const StatisticCurves::Plane& plane = curves.planes.front();
    ASSERT_EQ(plane.covariance.size(), curves.lags.size());
    EXPECT_NEAR(plane.covariance.front()[0], 1.0, 1e-12);
    EXPECT_NEAR(plane.covariance.front()[1], 4.0, 0.1);
    for (std::size_t s = 1; s < curves.lags.size(); ++s) EXPECT_NEAR(plane.covariance[s][0], 0.0, 0.03);
    ASSERT_EQ(plane.spectrum.size(), curves.frequencies.size());
    for (std::size_t k = 0; k < curves.frequencies.size(); ++k) {
        if (k > 0) {
            EXPECT_GT(curves.frequencies[k], curves.frequencies[k - 1]);
        }
        if (curves.frequencies[k] < 0.05) continue;  // few frequencies
        EXPECT_NEAR(plane.spectrum[k][0], 1.0, 0.15);
        EXPECT_NEAR(plane.spectrum[k][1], 4.0, 0.6);
    }
    EXPECT_LT(curves.frequencies.back(), std::numbers::sqrt2 / 2.0);
}

TEST(StatisticCurves, AWaveIsInItsRing) {
    Image wave({64, 64}, 1), other({64, 64}, 1);
    for (int r = 0; r < 64; ++r)
        for (int c = 0; c < 64; ++c) {
            wave.at(0, r, c) = static_cast<float>(std::cos(2.0 * std::numbers::pi * c / 8.0));
            other.at(0, r, c) = static_cast<float>(std::cos(2.0 * std::numbers::pi * r / 4.0));
        }
    const StatisticCurves curves = statistic_curves(wave, other);
    const auto& spectrum = curves.planes.front().spectrum;
    const auto loudest = [&](std::size_t which) {
        std::size_t best = 0;
        for (std::size_t k = 0; k < spectrum.size(); ++k)
            if (spectrum[k][which] > spectrum[best][which]) best = k;
        return curves.frequencies[best];
    };
    EXPECT_NEAR(std::log2(loudest(0) / 0.125), 0.0, 0.2);
    EXPECT_NEAR(std::log2(loudest(1) / 0.25), 0.0, 0.2);
    // Half a period apart along the row, and nothing along the column.
    for (std::size_t s = 0; s < curves.lags.size(); ++s) {
        if (curves.lags[s] == Offset{0, 4}) {
            EXPECT_NEAR(curves.planes.front().covariance[s][0], -1.0, 1e-6);
        }
        if (curves.lags[s] == Offset{4, 0}) {
            EXPECT_NEAR(curves.planes.front().covariance[s][0], 1.0, 1e-6);
        }
    }
}

TEST(StatisticCurves, CovariancesAreThoseOfTheReference) {
    const Image a = test::mixed_texture({40, 52}, 2, 1), b = test::mixed_texture({33, 47}, 2, 2);
    const StatisticCurves curves = statistic_curves(a, b);
    EXPECT_EQ(curves.lags.front(), Offset{});
    for (std::size_t s = 0; s < curves.lags.size(); ++s)
        for (int p = 0; p < 2; ++p) {
            const auto of = [&](const Image& image, Offset lag) {
                return reference::lag_covariance(image, p, p, lag);
            };
            const double variance = of(a, {});
            const auto& value = curves.planes[static_cast<std::size_t>(p)].covariance[s];
            EXPECT_NEAR(value[0], of(a, curves.lags[s]) / variance, 1e-9);
            EXPECT_NEAR(value[1], of(b, curves.lags[s]) / variance, 1e-9);
        }
}

TEST(StatisticCurves, HistogramsCountEveryPixelOnce) {
    Image a({2, 4}, 1), b({3, 1}, 1);
    std::iota(a.values().begin(), a.values().end(), 0.0F);  // 0 … 7
    b.values()[2] = 8.0F;
    const auto plane = statistic_curves(a, b).planes.front();
    EXPECT_EQ(plane.edges.size(), plane.histogram.size() + 1);
    EXPECT_EQ(plane.edges.front(), 0.0);
    EXPECT_EQ(plane.edges.back(), 8.0);
    double of_a = 0.0, of_b = 0.0;
    for (const auto& [x, y] : plane.histogram) {
        of_a += x;
        of_b += y;
    }
    EXPECT_NEAR(of_a, 1.0, 1e-12);
    EXPECT_NEAR(of_b, 1.0, 1e-12);
    EXPECT_NEAR(plane.histogram.front()[1], 2.0 / 3.0, 1e-12);
    EXPECT_NEAR(plane.histogram.back()[1], 1.0 / 3.0, 1e-12);
}

TEST(StatisticCurves, ConstantPlanesAndBadPictures) {
    Image a({16, 16}, 2), b = test::mixed_texture({16, 16}, 2, 1);
    std::ranges::copy(b.plane(0), a.plane(0).begin());
    const StatisticCurves curves = statistic_curves(a, b);
    EXPECT_TRUE(std::isnan(curves.planes[1].covariance.front()[1]));
    EXPECT_NEAR(curves.planes[0].covariance.front()[1], 1.0, 1e-9);
    EXPECT_THROW((void)statistic_curves(a, Image({4, 4}, 1)), InputError);
    EXPECT_THROW((void)statistic_curves(Image(), a), InputError);
    b.values()[3] = std::numeric_limits<float>::infinity();
    EXPECT_THROW((void)statistic_curves(a, b), InputError);
}

}  // namespace
}  // namespace btfield
