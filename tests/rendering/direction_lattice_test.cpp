// host/rendering/direction_lattice.cpp.

#include "host/rendering/direction_lattice.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "host/rendering/lit_table.hpp"
#include "tests/reference/direction_lattice.hpp"
#include "tests/rendering_cases.hpp"

namespace btfield {
namespace {

using namespace detail;
using test::degree;

TEST(DirectionSquare, PointsAreWhereTheirDirectionsAre) {
    for (const bool tangents : {false, true}) {
        const DirectionSquare square{7, 75.0 * degree, tangents};
        std::multiset<int> rings;
        for (int i = 0; i < square.count(); ++i) {
            const BtfDirection direction = square.at(i);
            rings.insert(static_cast<int>(std::lround(direction.theta / (25.0 * degree))));
            EXPECT_NEAR(direction.theta,
                        25.0 * degree * static_cast<double>(std::lround(direction.theta / (25.0 * degree))),
                        1e-12);
            const auto [column, row] = square.place(direction);
            EXPECT_NEAR(column, i % 7, 1e-9) << i;
            EXPECT_NEAR(row, i / 7, 1e-9) << i;
        }
        EXPECT_EQ(rings.count(0), 1U);
        EXPECT_EQ(rings.count(1), 8U);
        EXPECT_EQ(rings.count(3), 24U);
    }
}

TEST(DirectionSquare, PlacesAreContinuousAndEndAtTheEdge) {
    const DirectionSquare square{9, 60.0 * degree, true};
    for (int i = 0; i < 720; ++i) {
        const double phi = i * 0.5 * degree;
        const auto a = square.place({0.7, phi}), b = square.place({0.7, phi + 1e-6});
        EXPECT_NEAR(a[0], b[0], 1e-4) << i;
        EXPECT_NEAR(a[1], b[1], 1e-4) << i;
        EXPECT_EQ(square.place({1.5, phi}), square.place({60.0 * degree, phi}));
    }
    const auto right = square.place({60.0 * degree, 0.0}), up = square.place({60.0 * degree, 90.0 * degree});
    EXPECT_NEAR(right[0], 8.0, 1e-12);
    EXPECT_NEAR(right[1], 4.0, 1e-12);
    EXPECT_NEAR(up[1], 8.0, 1e-12);
    const auto only = DirectionSquare{3, 0.0, false}.place({0.3, 1.0});
    EXPECT_EQ(only[0], 1.0);
}

TEST(DirectionLattice, LiesCloseToTheTable) {
    const BtfModel model = test::smooth_btf({8, 8});
    const DirectionTable table(model);
    double last = 0.0;
    const DirectionLattice lattice = direction_lattice(table, 7, 4, [&](double share) { last = share; });
    EXPECT_EQ(last, 1.0);
    ASSERT_EQ(lattice.entries.size(), 49U * 49U);
    EXPECT_EQ(lattice.entries.front().weights.size(), 12U);
    for (const auto& [view, light] : {std::pair(BtfDirection{0.3, 1.0}, BtfDirection{0.7, 5.0}),
                                      std::pair(BtfDirection{1.2, 3.0}, BtfDirection{1.0, 3.1}),
                                      std::pair(BtfDirection{0.0, 0.0}, BtfDirection{1.5, 0.4})}) {
        const PictureWeights truth = first_planes(lit_weights(table, view, light), 4),
                             found = reference::between(lattice, view, light);
        for (std::size_t c = 0; c < 3; ++c) {
            // They fall with theta, which is max(|x|, |y|) of the square: where a cell has the diagonal,
            // a quarter of a ring off at most, which is 0.005 of the offsets and 0.02 of the means.
            EXPECT_NEAR(found.mean[c], truth.mean[c], 0.025 * truth.mean[c]);
            EXPECT_NEAR(found.offsets[c], truth.offsets[c], 6e-3);
        }
        for (std::size_t i = 0; i < 12; ++i) EXPECT_NEAR(found.weights[i], truth.weights[i], 6e-3) << i;
    }
}

}  // namespace
}  // namespace btfield
