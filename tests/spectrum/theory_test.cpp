#include "btfield/theory.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

#include "btfield/error.hpp"
#include "btfield/pyramid.hpp"
#include "tests/reference/algebra.hpp"
#include "tests/reference/fields.hpp"

namespace btfield {
namespace {

TextureModel model_of(int planes, int levels, int factor, Size size) {
    TextureModel model;
    model.planes = planes;
    model.factor = factor;
    model.size = size;
    model.mean.assign(static_cast<std::size_t>(planes), 0.5);
    const std::vector<Size> sizes = pyramid_sizes(size, levels, factor);
    for (int k = 0; k < levels; ++k) {
        LevelModel level;
        level.size = sizes[static_cast<std::size_t>(k)];
        CarModel car;
        static_cast<LinearField&>(car) = reference::random_field(
            planes, neighbourhood(2, NeighbourhoodKind::causal), 0.9, static_cast<unsigned>(k + 1));
        level.models = {car};
        level.gain = 0.5 + 0.4 * k;
        model.levels.push_back(level);
    }
    return model;
}

/// Value of the level at q, seen at full resolution, on the torus: separable, one expansion after the other.
Eigen::MatrixXd expansions(int coarse, int factor, int depth) {
    const std::vector<double> w = pyramid_kernel(factor);
    const int radius = static_cast<int>(w.size()) / 2;
    Eigen::MatrixXd e = Eigen::MatrixXd::Identity(coarse, coarse);
    for (int k = 0; k < depth; ++k) {
        const int from = static_cast<int>(e.rows()), to = from * factor;
        Eigen::MatrixXd step = Eigen::MatrixXd::Zero(to, from);
        for (int q = 0; q < from; ++q) {
            for (int t = -radius; t <= radius; ++t) {
                step(reference::wrapped(factor * q + t, to), q) +=
                    factor * w[static_cast<std::size_t>(t + radius)];
            }
        }
        e = reference::product(step, e);
    }
    return e;
}

struct Case {
    int planes, levels, factor;
    Size size;
};

class Theories : public testing::TestWithParam<Case> {};

TEST_P(Theories, AddTheCovariancesOfAllPixelsOfAllLevels) {
    const auto [planes, levels, factor, size] = GetParam();
    const TextureModel model = model_of(planes, levels, factor, size);
    const auto pixels = static_cast<Eigen::Index>(area(size));
    Eigen::MatrixXd total = Eigen::MatrixXd::Zero(pixels * planes, pixels * planes);
    for (int k = 0; k < levels; ++k) {
        const LevelModel& level = model.levels[static_cast<std::size_t>(k)];
        const Eigen::MatrixXd rows = expansions(level.size.height, factor, k);
        const Eigen::MatrixXd columns = expansions(level.size.width, factor, k);
        const auto level_pixels = static_cast<Eigen::Index>(area(level.size));
        Eigen::MatrixXd expand(pixels, level_pixels);
        for (Eigen::Index r = 0; r < pixels; ++r) {
            for (Eigen::Index q = 0; q < level_pixels; ++q) {
                expand(r, q) = rows(r / size.width, q / level.size.width) *
                               columns(r % size.width, q % level.size.width);
            }
        }
        const Eigen::MatrixXd covariance =
            reference::field_covariance(linear_field(level.models.front()), level.size);
        for (int i = 0; i < planes; ++i) {
            for (int j = 0; j < planes; ++j) {
                const Eigen::MatrixXd block =
                    covariance.block(i * level_pixels, j * level_pixels, level_pixels, level_pixels);
                total.block(i * pixels, j * pixels, pixels, pixels) +=
                    level.gain * level.gain * reference::congruent(expand, block);
            }
        }
    }
    const std::vector<Offset> lags = {{0, 0}, {0, 1}, {1, 0}, {1, 1}, {1, -1}, {2, 3}, {-3, 2}, {0, 4}};
    const std::vector<double> found = theoretical_covariance(model, size, lags);
    ASSERT_EQ(found.size(), lags.size() * static_cast<std::size_t>(planes * planes));
    std::size_t next = 0;
    for (const Offset s : lags) {
        for (int i = 0; i < planes; ++i) {
            for (int j = 0; j < planes; ++j) {
                // Sums of up to some thousand products of order one, in float64 both.
                EXPECT_NEAR(found[next++], reference::lag_covariance(total, size, i, j, s), 1e-10)
                    << s.row << ' ' << s.column;
            }
        }
    }
    const std::vector<double> deviation = theoretical_deviation(model, size);
    for (int i = 0; i < planes; ++i) {
        EXPECT_NEAR(deviation.at(static_cast<std::size_t>(i)),
                    std::sqrt(reference::lag_covariance(total, size, i, i, {})), 1e-10);
    }
}

INSTANTIATE_TEST_SUITE_P(Theory, Theories,
                         testing::Values(Case{1, 1, 2, {7, 9}}, Case{2, 2, 2, {8, 6}}, Case{1, 3, 2, {8, 12}},
                                         Case{2, 2, 3, {9, 6}}, Case{1, 3, 3, {9, 9}}));

TEST(Theory, OtherSizesOfTheSameModelAgreeWhereTheTorusIsWide) {
    // Responses to noise fall by 0.9 a pixel at most, in fact much faster: around 48 pixels nothing is left
    // to see.
    const TextureModel model = model_of(2, 2, 2, {48, 48});
    const std::vector<Offset> lags = {{0, 0}, {0, 1}, {3, 2}};
    const std::vector<double> small = theoretical_covariance(model, {48, 48}, lags);
    const std::vector<double> large = theoretical_covariance(model, {96, 80}, lags);
    for (std::size_t k = 0; k < small.size(); ++k) EXPECT_NEAR(small[k], large[k], 1e-6);
}

TEST(Theory, RefusesEmptyTextures) {
    const TextureModel model = model_of(1, 1, 2, {8, 8});
    EXPECT_THROW((void)theoretical_deviation(model, {0, 8}), InputError);
    EXPECT_THROW((void)theoretical_deviation(TextureModel{}, {8, 8}), InputError);
}

}  // namespace
}  // namespace btfield
