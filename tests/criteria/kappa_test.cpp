#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "btfield/criteria.hpp"
#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "tests/places.hpp"

namespace btfield {
namespace {

/// Planes that take ±amplitude such that every pair is uncorrelated: Σ is diagonal, amplitude².
Image orthogonal(const std::vector<float>& amplitudes) {
    const auto d = static_cast<int>(amplitudes.size());
    Image image({1, 1 << d}, d);
    for (int p = 0; p < d; ++p)
        for (int c = 0; c < image.width(); ++c)
            image.at(p, 0, c) =
                0.5F + ((c >> p & 1) != 0 ? 1.0F : -1.0F) * amplitudes[static_cast<std::size_t>(p)];
    return image;
}

// Products and sums of a few numbers of full float64 precision.
constexpr double rounding = 1e-13;

TEST(Kappa, DiagonalCovariance) {
    const Image image = orthogonal({0.25F, 0.125F, 0.5F});
    const Kappa result = kappa(image);
    EXPECT_NEAR(result.covariance[0], 64.0 * 64.0, 64 * 64 * rounding);
    EXPECT_NEAR(result.covariance[4], 32.0 * 32.0, 32 * 32 * rounding);
    EXPECT_NEAR(result.covariance[1], 0.0, 64 * 64 * rounding);
    const double expected = (64.0 * 64.0) * (32.0 * 32.0) * (128.0 * 128.0) / (256.0 * 256.0 * 256.0);
    EXPECT_NEAR(result.kappa, expected, expected * rounding);
    EXPECT_FALSE(result.two_dimensional());
}

TEST(Kappa, UnitsAndWhite) {
    const Image image = orthogonal({0.25F, 0.125F});
    // κ(c) = det(Σ) cⁿ / white²ⁿ with Σ in the picture's own units.
    const double det = 0.25 * 0.25 * 0.125 * 0.125;
    EXPECT_NEAR(kappa(image, 100.0).kappa, det * 1e4, det * 1e4 * rounding);
    EXPECT_NEAR(kappa(image, 256.0, 3.0).kappa, det * 256 * 256 / 81.0, det * 256 * 256 / 81 * rounding);
}

TEST(Kappa, WhiteLevelWhereTheVerdictTurns) {
    const Image image = orthogonal({0.25F, 0.125F, 0.5F});
    const double turn = kappa(image).white_at_threshold;
    EXPECT_EQ(kappa(image, 256.0, 7.0).white_at_threshold > 0.0, true);
    EXPECT_NEAR(kappa(image, 256.0, 7.0).white_at_threshold, turn, turn * 1e-12);
    // The sixth power of 1 ± 1e-9 leaves the threshold by more than rounding.
    EXPECT_FALSE(kappa(image, 256.0, turn * (1.0 - 1e-9)).two_dimensional());
    EXPECT_TRUE(kappa(image, 256.0, turn * (1.0 + 1e-9)).two_dimensional());
}

TEST(Kappa, CorrelatedPlanesAndConstants) {
    Image image = orthogonal({0.25F, 0.125F});
    std::copy(image.plane(0).begin(), image.plane(0).end(), image.plane(1).begin());
    EXPECT_EQ(kappa(image).kappa, 0.0);
    EXPECT_TRUE(kappa(image).two_dimensional());
    EXPECT_EQ(kappa(image).white_at_threshold, 0.0);
    EXPECT_EQ(kappa(Image({4, 4}, 3)).kappa, 0.0);
}

TEST(Kappa, ManyPlanes) {
    std::mt19937 generator(1);
    std::normal_distribution<float> normal(0.0F, 0.1F);
    Image image({64, 64}, 31);
    for (float& value : image.values()) value = normal(generator);
    // Nearly white noise: log κ is near 31 log(0.1² · 256). The log-determinant of a sample covariance of N
    // pixels has mean −n(n+1)/2N and variance 2n/N about it.
    const double expected = 31.0 * std::log(0.01 * 256.0);
    EXPECT_NEAR(std::log(kappa(image).kappa), expected,
                31.0 * 32.0 / (2 * 4096.0) + 6.0 * std::sqrt(2.0 * 31.0 / 4096.0));
}

TEST(Kappa, RealPictures) {
    const auto of = [](const char* file) {
        return kappa(read_picture(test::data_folder() + "/" + file).image);
    };
    const Kappa cork = of("cork.png");
    const std::vector<double>& s = cork.covariance;
    const double determinant = s[0] * (s[4] * s[8] - s[5] * s[7]) - s[1] * (s[3] * s[8] - s[5] * s[6]) +
                               s[2] * (s[3] * s[7] - s[4] * s[6]);
    // The terms of the determinant cancel to a small part of the largest one.
    const double units = 256.0 * 256.0 * 256.0;
    EXPECT_NEAR(cork.kappa, determinant / units, 1e-13 * s[0] * s[4] * s[8] / units);
    EXPECT_TRUE(cork.two_dimensional());
    EXPECT_FALSE(of("grass.png").two_dimensional());
    EXPECT_EQ(of("rock.png").kappa, 0.0);  // three equal planes
}

TEST(Kappa, Refusals) {
    const auto refused = [](const Image& image, double cmax, double white) {
        try {
            static_cast<void>(kappa(image, cmax, white));
        } catch (const InputError&) {
            return true;
        }
        return false;
    };
    const double not_a_number = std::numeric_limits<double>::quiet_NaN();
    const Image image = orthogonal({0.25F});
    EXPECT_FALSE(refused(image, 256.0, 1.0));
    EXPECT_TRUE(refused(Image(), 256.0, 1.0));
    for (const double bad : {0.0, -1.0, not_a_number, std::numeric_limits<double>::infinity()}) {
        EXPECT_TRUE(refused(image, bad, 1.0)) << bad;
        EXPECT_TRUE(refused(image, 256.0, bad)) << bad;
    }
    Image bad = image;
    bad.at(0, 0, 0) = std::numeric_limits<float>::quiet_NaN();
    EXPECT_TRUE(refused(bad, 256.0, 1.0));
}

}  // namespace
}  // namespace btfield
