#include "btfield/pyramid.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "btfield/error.hpp"
#include "host/analysis/pyramid_stages.hpp"
#include "tests/device_cases.hpp"
#include "tests/reference/pyramid.hpp"

namespace btfield {

using namespace detail;

namespace {

double largest(std::span<const float> values) {
    double most = 0.0;
    for (const float v : values) most = std::max(most, std::abs(static_cast<double>(v)));
    return most;
}

/// Rounding of one separable step (reduce or expand): each of its two sums has at most 2n + 1 terms with
/// weights that are rounded once and add up to 1 for every pixel, so each sum of t fused products is off by
/// (t + 1)·u·max|y|.
double step_bound(int factor, double most) {
    return 2.0 * (2.0 * factor + 2.0) * test::unit_roundoff * most;
}

/// Of a Laplacian level: the reduce and expand before it on values up to max|y|, one subtraction, and one
/// more reduce for every level above.
double level_bound(int factor, int level, double most) {
    return (level + 2.0) * step_bound(factor, most) + 2.0 * test::unit_roundoff * most;
}

void expect_near(const Image& found, int plane, const reference::Plane& expected, double bound) {
    ASSERT_EQ(found.size(), expected.size);
    for (std::size_t i = 0; i < expected.values.size(); ++i)
        ASSERT_LE(std::abs(static_cast<double>(found.plane(plane)[i]) - expected.values[i]), bound)
            << "plane " << plane << ", pixel " << i;
}

void expect_same(const Image& a, const Image& b, double bound) {
    ASSERT_EQ(a.size(), b.size());
    ASSERT_EQ(a.planes(), b.planes());
    for (std::size_t i = 0; i < a.values().size(); ++i)
        ASSERT_LE(std::abs(static_cast<double>(a.values()[i]) - static_cast<double>(b.values()[i])), bound)
            << "value " << i;
}

/// Levels against the reference, and their collapse against the picture.
void check(Device& device, const Image& image, int levels, int factor) {
    SCOPED_TRACE(test::text(image.size()) + ", " + std::to_string(levels) + " levels, factor " +
                 std::to_string(factor));
    const double most = largest(image.values());
    const std::vector<Image> found = decompose(device, image, levels, factor);
    ASSERT_EQ(found.size(), static_cast<std::size_t>(levels));
    for (int p = 0; p < image.planes(); ++p) {
        const std::vector<reference::Plane> expected =
            reference::decompose(reference::Plane(image, p), levels, factor);
        for (int k = 0; k < levels; ++k) {
            ASSERT_EQ(found[static_cast<std::size_t>(k)].planes(), image.planes());
            expect_near(found[static_cast<std::size_t>(k)], p, expected[static_cast<std::size_t>(k)],
                        level_bound(factor, k, most));
        }
    }
    // Expanding the same numbers twice rounds in the same way: what stays is one subtraction and one addition
    // a level.
    expect_same(collapse(device, found, factor), image, 4.0 * levels * test::unit_roundoff * most);
}

class PyramidSmall : public testing::TestWithParam<int> {
  protected:
    Device device_ = test::device_of_width(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Widths, PyramidSmall, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(PyramidSmall, LevelsFollowTheReference) {
    for (const Size size : test::lattice_sizes) check(device_, test::random_image(size, 2, 1.0F), 3, 2);
}

TEST_P(PyramidSmall, LevelsOfFactorThreeFollowTheReference) {
    for (const Size size : {Size{1, 1}, Size{2, 7}, Size{17, 31}, Size{19, 67}})
        check(device_, test::random_image(size, 2, 1.0F), 2, 3);
}

class Pyramid : public testing::Test {
  protected:
    Device device_;
};

TEST_F(Pyramid, EverySmallSizeComesBack) {
    for (int height = 1; height <= 9; ++height)
        for (int width = 1; width <= 9; ++width)
            for (const int levels : {2, 3, 5})
                check(device_, test::random_image({height, width}, 1, 1.0F), levels, 2);
}

TEST_F(Pyramid, EveryFactorAndDepth) {
    for (const int factor : {2, 3, 4, 5})
        for (int levels = 1; levels <= 5; ++levels)
            for (const Size size : {Size{61, 53}, Size{64, 48}})
                check(device_, test::random_image(size, 1, 1.0F), levels, factor);
}

TEST_F(Pyramid, PlanesAreIndependentOfEachOther) {
    for (const int planes : test::plane_counts) {
        const Image image = test::random_image({23, 37}, planes);
        const std::vector<Image> together = decompose(device_, image, 3, 2);
        for (int p = 0; p < planes; ++p) {
            Image alone(image.size(), 1);
            std::copy(image.plane(p).begin(), image.plane(p).end(), alone.values().begin());
            const std::vector<Image> levels = decompose(device_, alone, 3, 2);
            for (std::size_t k = 0; k < levels.size(); ++k)
                EXPECT_TRUE(std::ranges::equal(levels[k].values(), std::as_const(together[k]).plane(p)))
                    << "plane " << p << " of " << planes << ", level " << k;
        }
    }
}

TEST_F(Pyramid, ConstantsStayConstant) {
    for (const int factor : {2, 3, 4, 5})
        for (const Size size : {Size{1, 1}, Size{5, 3}, Size{30, 41}, Size{60, 60}}) {
            SCOPED_TRACE(test::text(size) + ", factor " + std::to_string(factor));
            Image image(size, 1);
            std::ranges::fill(image.values(), 0.7F);
            const std::vector<Image> levels = decompose(device_, image, 3, factor);
            for (std::size_t k = 0; k < levels.size(); ++k)
                for (const float value : levels[k].values())
                    ASSERT_LE(
                        std::abs(static_cast<double>(value) - (k == 2 ? static_cast<double>(0.7F) : 0.0)),
                        level_bound(factor, static_cast<int>(k), 0.7))
                        << "level " << k;
        }
}

TEST_F(Pyramid, ShiftsByTheFactorShiftTheLevels) {
    // The torus has no borders: sides are multiples of n², the shift is n².
    const Size size{32, 48};
    const Image image = test::random_image(size, 1);
    Image shifted(size, 1);
    for (int row = 0; row < size.height; ++row)
        for (int column = 0; column < size.width; ++column)
            shifted.at(0, (row + 4) % size.height, (column + 8) % size.width) = image.at(0, row, column);
    const std::vector<Image> levels = decompose(device_, image, 3, 2),
                             moved = decompose(device_, shifted, 3, 2);
    for (std::size_t k = 0; k < levels.size(); ++k) {
        const Size level = levels[k].size();
        const int rows = 4 >> k, columns = 8 >> k;
        for (int row = 0; row < level.height; ++row)
            for (int column = 0; column < level.width; ++column)
                ASSERT_LE(std::abs(static_cast<double>(
                              levels[k].at(0, row, column) -
                              moved[k].at(0, (row + rows) % level.height, (column + columns) % level.width))),
                          2.0 * level_bound(2, static_cast<int>(k), largest(image.values())))
                    << "level " << k << ", row " << row << ", column " << column;
    }
}

TEST_F(Pyramid, OneLevelIsThePicture) {
    Image image = test::random_image({7, 9}, 2);
    image.set_space(ColourSpace::xyz);
    const std::vector<Image> levels = decompose(device_, image, 1, 2);
    ASSERT_EQ(levels.size(), 1U);
    expect_same(levels[0], image, 0.0);
    expect_same(collapse(device_, levels, 2), image, 0.0);
    EXPECT_EQ(levels[0].space(), ColourSpace::xyz);
    EXPECT_EQ(collapse(device_, decompose(device_, image, 3, 2), 2).space(), ColourSpace::xyz);
}

TEST_F(Pyramid, StagesTakePlanesFromLargerLattices) {
    // Synthesis grows levels on lattices that suit the transform: what lies beyond the level's size must not
    // matter.
    const Size fine{14, 22}, fine_lattice{15, 24}, coarse{7, 11}, coarse_lattice{8, 12};
    const auto pitched = [&](const Image& image, Size lattice) {
        std::vector<float> values(area(lattice) * static_cast<std::size_t>(image.planes()),
                                  std::numeric_limits<float>::quiet_NaN());
        for (int p = 0; p < image.planes(); ++p)
            for (int row = 0; row < image.height(); ++row)
                for (int column = 0; column < image.width(); ++column)
                    values[(static_cast<std::size_t>(p) * static_cast<std::size_t>(lattice.height) +
                            static_cast<std::size_t>(row)) *
                               static_cast<std::size_t>(lattice.width) +
                           static_cast<std::size_t>(column)] = image.at(p, row, column);
        return DevicePlanes{device_.impl().upload(values), image.size(), lattice, image.planes()};
    };
    const Image base = test::random_image(fine, 3, 0.0F, 2), small = test::random_image(coarse, 3, 0.0F, 3);
    const float scale = 0.75F;
    PyramidStages stages(device_.impl(), 2);
    const DevicePlanes sum =
        stages.add_expanded(pitched(base, fine_lattice), pitched(small, coarse_lattice), scale);
    ASSERT_EQ(sum.size, fine);
    ASSERT_EQ(sum.lattice, fine);
    Image found(fine, 3);
    device_.impl().read(sum.values, found.values().data(), found.values().size_bytes());
    for (int p = 0; p < 3; ++p) {
        reference::Plane expected = reference::expand(reference::Plane(small, p), fine, 2);
        const reference::Plane below(base, p);
        for (std::size_t i = 0; i < expected.values.size(); ++i)
            expected.values[i] = below.values[i] + static_cast<double>(scale) * expected.values[i];
        expect_near(found, p, expected,
                    step_bound(2, largest(small.values())) +
                        2.0 * test::unit_roundoff * (largest(base.values()) + largest(small.values())));
    }
}

TEST(PyramidKernel, SumsToOneOverEveryPhase) {
    EXPECT_EQ(pyramid_kernel(2), (std::vector<double>{0.05, 0.25, 0.4, 0.25, 0.05}));
    for (int factor = 2; factor <= 9; ++factor) {
        const std::vector<double> w = pyramid_kernel(factor);
        const int radius = static_cast<int>(w.size()) / 2;
        EXPECT_EQ(w.size(), factor == 2 ? 5U : 2U * static_cast<std::size_t>(factor) + 1U);
        for (int t = 0; t <= 2 * radius; ++t) {
            EXPECT_LE(std::abs(w[static_cast<std::size_t>(t)] - w[static_cast<std::size_t>(2 * radius - t)]),
                      1e-16);
            EXPECT_GT(w[static_cast<std::size_t>(t)], 0.0);
            if (t > 0 && t <= radius) {
                EXPECT_GE(w[static_cast<std::size_t>(t)], w[static_cast<std::size_t>(t - 1)]);
            }
        }
        // Sums of at most 19 float64 weights below 1.
        EXPECT_LE(std::abs(std::accumulate(w.begin(), w.end(), 0.0) - 1.0), 1e-15 * factor);
        for (int phase = 0; phase < factor; ++phase) {
            double sum = 0.0;
            for (int t = -radius; t <= radius; ++t)
                if ((t - phase) % factor == 0) sum += w[static_cast<std::size_t>(t + radius)];
            EXPECT_LE(std::abs(sum - 1.0 / factor), 1e-15) << "factor " << factor << ", phase " << phase;
        }
    }
    for (const int factor : {1, 0, -2}) EXPECT_THROW((void)pyramid_kernel(factor), InputError);
}

TEST(PyramidSizes, AreRoundedUp) {
    EXPECT_EQ(pyramid_sizes({37, 100}, 4, 2), (std::vector<Size>{{37, 100}, {19, 50}, {10, 25}, {5, 13}}));
    EXPECT_EQ(pyramid_sizes({37, 100}, 3, 5), (std::vector<Size>{{37, 100}, {8, 20}, {2, 4}}));
    EXPECT_EQ(pyramid_sizes({1, 3}, 4, 3), (std::vector<Size>{{1, 3}, {1, 1}, {1, 1}, {1, 1}}));
    const int most = std::numeric_limits<int>::max();
    EXPECT_EQ(pyramid_sizes({most, most}, 2, 2)[1], (Size{1 << 30, 1 << 30}));
    EXPECT_EQ(pyramid_sizes({most, 5}, 2, most)[1], (Size{1, 1}));
    EXPECT_THROW((void)pyramid_sizes({8, 8}, 0, 2), InputError);
    EXPECT_THROW((void)pyramid_sizes({8, 8}, 3, 1), InputError);
    EXPECT_THROW((void)pyramid_sizes({8, 8}, 3, -2), InputError);
}

TEST_F(Pyramid, RefusesWhatIsNoPyramid) {
    const Image image = test::random_image({12, 12}, 2);
    EXPECT_THROW((void)decompose(device_, image, 0, 2), InputError);
    EXPECT_THROW((void)decompose(device_, image, 2, 1), InputError);
    EXPECT_THROW((void)collapse(device_, {}, 2), InputError);
    EXPECT_THROW((void)collapse(device_, {image}, 1), InputError);
    const std::vector<Image> levels = decompose(device_, image, 3, 2);
    EXPECT_THROW((void)collapse(device_, levels, 3), InputError);
    EXPECT_THROW((void)collapse(device_, {levels[0], levels[2]}, 2), InputError);
    EXPECT_THROW((void)collapse(device_, {levels[2], levels[1], levels[0]}, 2), InputError);
    EXPECT_THROW((void)collapse(device_, {levels[0], test::random_image({6, 6}, 1), levels[2]}, 2),
                 InputError);
    try {
        (void)collapse(device_, {levels[0], test::random_image({6, 7}, 2), levels[2]}, 2);
        ADD_FAILURE() << "levels of different pyramids were collapsed";
    } catch (const InputError& error) {
        const std::string text = error.what();
        EXPECT_NE(text.find("level 1 is 7x6"), std::string::npos) << text;
        EXPECT_NE(text.find("give 6x6"), std::string::npos) << text;
    }
}

}  // namespace
}  // namespace btfield
