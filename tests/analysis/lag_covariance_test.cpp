#include "btfield/lag_covariance.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "btfield/error.hpp"
#include "tests/reference/lag_covariance.hpp"

namespace btfield {
namespace {

Image noise(Size size, int planes, unsigned seed, float mean = 0.5F) {
    Image image(size, planes);
    std::mt19937 engine(seed);
    std::normal_distribution<float> normal(mean, 0.3F);
    for (float& value : image.values()) value = normal(engine);
    // Planes and neighbours that depend on each other, so that no covariance is zero by symmetry.
    for (int p = 1; p < planes; ++p) {
        for (std::size_t k = 0; k < area(size); ++k) {
            image.plane(p)[k] += 0.5F * image.plane(p - 1)[(k + 1) % area(size)];
        }
    }
    return image;
}

/// Sums of M products, each rounded to 2^-53 relative, in any order: the error of the mean is at most M 2^-53
/// times the mean magnitude of a product, √(C_ii C_jj) by Cauchy-Schwarz; twice that for two such sums and
/// the two means (whose own error, M 2^-53 |μ|, enters the products once).
double tolerance(const Image& image, int i, int j) {
    const double pixels = static_cast<double>(area(image.size()));
    const auto scale = [&](int p) {
        return std::sqrt(reference::lag_covariance(image, p, p, {})) + std::abs(reference::mean(image, p));
    };
    return 4.0 * (pixels + 8.0) * std::numeric_limits<double>::epsilon() * scale(i) * scale(j);
}

struct Case {
    Size size;
    int planes;
    Offset box;
};

class LagCovarianceCases : public testing::TestWithParam<Case> {};

TEST_P(LagCovarianceCases, EqualsTheDefinition) {
    const auto [size, planes, box] = GetParam();
    const Image image = noise(size, planes, 7);
    const LagCovariance statistic = lag_covariance(image, box);
    EXPECT_EQ(statistic.size(), size);
    EXPECT_EQ(statistic.planes(), planes);
    EXPECT_EQ(statistic.box(), box);
    for (int i = 0; i < planes; ++i) {
        EXPECT_NEAR(statistic.mean()[static_cast<std::size_t>(i)], reference::mean(image, i), 1e-14);
        for (int j = 0; j < planes; ++j) {
            for (int row = -box.row; row <= box.row; ++row) {
                for (int column = -box.column; column <= box.column; ++column) {
                    const Offset s{row, column};
                    ASSERT_TRUE(statistic.contains(s));
                    ASSERT_NEAR(statistic(i, j, s), reference::lag_covariance(image, i, j, s),
                                tolerance(image, i, j))
                        << i << ' ' << j << " lag " << row << ' ' << column;
                }
            }
        }
    }
}

TEST_P(LagCovarianceCases, ListedLagsEqualTheDefinition) {
    const auto [size, planes, box] = GetParam();
    const Image image = noise(size, planes, 11);
    const std::vector<Offset> lags = {{0, 0},
                                      {0, 1},
                                      {1, -1},
                                      {-box.row, box.column},
                                      {3, 5},
                                      {0, 1},
                                      {-size.height, 2},
                                      {7, -size.width - 1},
                                      {-2, 0},
                                      {16, 16},
                                      {0, -1}};
    const std::vector<double> values = covariances_at(image, lags);
    ASSERT_EQ(values.size(), lags.size() * static_cast<std::size_t>(planes * planes));
    std::size_t next = 0;
    for (const Offset s : lags) {
        for (int i = 0; i < planes; ++i) {
            for (int j = 0; j < planes; ++j) {
                ASSERT_NEAR(values[next++], reference::lag_covariance(image, i, j, s),
                            tolerance(image, i, j));
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Sizes, LagCovarianceCases,
                         testing::Values(Case{{1, 1}, 1, {2, 2}}, Case{{1, 7}, 2, {1, 9}},
                                         Case{{5, 1}, 3, {6, 1}}, Case{{2, 3}, 3, {4, 4}},
                                         Case{{13, 17}, 1, {2, 4}}, Case{{31, 29}, 3, {4, 4}},
                                         Case{{64, 48}, 4, {2, 3}}, Case{{37, 41}, 5, {2, 2}},
                                         Case{{19, 23}, 8, {1, 2}}, Case{{200, 6}, 2, {3, 7}},
                                         Case{{6, 200}, 2, {3, 7}}),
                         [](const auto& parameter) {
                             const Case& c = parameter.param;
                             return "H" + std::to_string(c.size.height) + "W" + std::to_string(c.size.width) +
                                    "d" + std::to_string(c.planes);
                         });

TEST(LagCovariance, RepeatsBitForBit) {
    const Image image = noise({150, 131}, 3, 3);
    const Offset box{2, 4};
    const LagCovariance first = lag_covariance(image, box), second = lag_covariance(image, box);
    for (int row = -2; row <= 2; ++row) {
        for (int column = -4; column <= 4; ++column) {
            for (int i = 0; i < 3; ++i) {
                for (int j = 0; j < 3; ++j) {
                    EXPECT_EQ(first(i, j, {row, column}), second(i, j, {row, column}));
                }
            }
        }
    }
}

TEST(LagCovariance, LargeOffsetKeepsItsDigits) {
    // Values around 4096 whose float spacing is 2^-11: they are what they are after rounding, and centring
    // them in float64 must lose nothing more than the rounding of the mean.
    const Image image = noise({40, 50}, 1, 5, 4096.0F);
    const LagCovariance statistic = lag_covariance(image, {1, 1});
    EXPECT_NEAR(statistic(0, 0, {}), reference::lag_covariance(image, 0, 0, {}), tolerance(image, 0, 0));
    EXPECT_GT(statistic(0, 0, {}), 0.05);
}

TEST(LagCovariance, ConstantPlaneIsZero) {
    Image image({9, 8}, 1);
    for (float& value : image.values()) value = 0.25F;
    const LagCovariance statistic = lag_covariance(image, {1, 1});
    EXPECT_EQ(statistic(0, 0, {1, 1}), 0.0);
    EXPECT_EQ(statistic.mean()[0], 0.25);
}

TEST(LagCovariance, SetReachesBothHalves) {
    LagCovariance statistic(2, {4, 4}, {1, 1});
    statistic.set(0, 1, {0, 0}, 3.0);
    EXPECT_EQ(statistic(1, 0, {0, 0}), 3.0);
    statistic.set(0, 1, {-1, 1}, 2.0);
    EXPECT_EQ(statistic(0, 1, {-1, 1}), 2.0);
    EXPECT_EQ(statistic(1, 0, {1, -1}), 2.0);
    EXPECT_EQ(statistic(0, 1, {1, -1}), 0.0);
    EXPECT_FALSE(statistic.contains({2, 0}));
    EXPECT_FALSE(statistic.contains({0, -2}));
}

TEST(LagCovariance, RefusesEmptyPicturesAndImpossibleBoxes) {
    EXPECT_THROW((void)lag_covariance(Image{}, {1, 1}), InputError);
    EXPECT_THROW((void)covariances_at(Image{}, std::vector<Offset>{{0, 0}}), InputError);
    const Image image({4, 4}, 1);
    EXPECT_THROW((void)lag_covariance(image, {-1, 1}), InputError);
    EXPECT_THROW((void)lag_covariance(image, {1, -1}), InputError);
    EXPECT_THROW((void)lag_covariance(image, {1 << 20, 1 << 20}), InputError);
}

TEST(LagCovariance, ProbeLagsStayBelowHalfTheShorterSide) {
    EXPECT_EQ(probe_lags({512, 512}).size(), 21U);
    EXPECT_EQ(probe_lags({33, 512}).size(), 21U);
    EXPECT_EQ(probe_lags({32, 512}).size(), 17U);
    EXPECT_EQ(probe_lags({512, 3}).size(), 5U);
    EXPECT_EQ(probe_lags({2, 2}), (std::vector<Offset>{{0, 0}}));
    EXPECT_EQ(probe_lags({3, 3}), (std::vector<Offset>{{0, 0}, {0, 1}, {1, 0}, {1, 1}, {1, -1}}));
}

}  // namespace
}  // namespace btfield
