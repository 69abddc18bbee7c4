#include "btfield/neighbourhood.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>

#include "btfield/error.hpp"

namespace btfield {
namespace {

constexpr std::array kinds = {NeighbourhoodKind::symmetric, NeighbourhoodKind::half,
                              NeighbourhoodKind::causal, NeighbourhoodKind::unilateral};

TEST(Neighbourhood, SymmetricCountsAreThoseOfTheHierarchy) {
    constexpr std::array<std::size_t, max_order> counts = {4, 8, 12, 20, 24, 28, 36, 44};
    for (int order = 1; order <= max_order; ++order) {
        const auto symmetric = neighbourhood(order, NeighbourhoodKind::symmetric);
        EXPECT_EQ(symmetric.size(), counts[static_cast<std::size_t>(order - 1)]) << "order " << order;
        EXPECT_EQ(neighbourhood(order, NeighbourhoodKind::half).size(), symmetric.size() / 2);
        EXPECT_EQ(neighbourhood(order, NeighbourhoodKind::causal).size(), symmetric.size() / 2);
    }
}

TEST(Neighbourhood, OffsetsAreInRasterOrderWithoutCentreOrDuplicates) {
    for (const NeighbourhoodKind kind : kinds) {
        for (int order = 1; order <= max_order; ++order) {
            const auto offsets = neighbourhood(order, kind);
            EXPECT_TRUE(std::is_sorted(offsets.begin(), offsets.end()));
            EXPECT_EQ(std::set<Offset>(offsets.begin(), offsets.end()).size(), offsets.size());
            EXPECT_EQ(std::count(offsets.begin(), offsets.end(), Offset{}), 0);
        }
    }
}

TEST(Neighbourhood, EachOrderContainsTheOneBefore) {
    for (const NeighbourhoodKind kind : kinds) {
        for (int order = 2; order <= max_order; ++order) {
            const auto small = neighbourhood(order - 1, kind), large = neighbourhood(order, kind);
            EXPECT_TRUE(std::includes(large.begin(), large.end(), small.begin(), small.end()));
            EXPECT_GE(large.size(), small.size());
        }
    }
}

TEST(Neighbourhood, HalfAndCausalMirrorEachOtherAndMakeTheSymmetricOne) {
    for (int order = 1; order <= max_order; ++order) {
        const auto half = neighbourhood(order, NeighbourhoodKind::half);
        std::vector<Offset> joined = neighbourhood(order, NeighbourhoodKind::causal);
        for (const Offset s : half) {
            EXPECT_GT(s, Offset{});
            EXPECT_EQ(std::count(joined.begin(), joined.end(), -s), 1);
        }
        joined.insert(joined.end(), half.begin(), half.end());
        EXPECT_EQ(joined, neighbourhood(order, NeighbourhoodKind::symmetric));
    }
}

TEST(Neighbourhood, UnilateralIsTheQuarterPlane) {
    EXPECT_EQ(neighbourhood(2, NeighbourhoodKind::unilateral),
              (std::vector<Offset>{{-1, -1}, {-1, 0}, {0, -1}}));
    EXPECT_EQ(neighbourhood(5, NeighbourhoodKind::unilateral).size(), 8U);
    EXPECT_EQ(neighbourhood(1, NeighbourhoodKind::causal), (std::vector<Offset>{{-1, 0}, {0, -1}}));
}

TEST(Neighbourhood, DifferenceBoxHoldsEveryDifference) {
    for (const NeighbourhoodKind kind : kinds) {
        for (int order = 1; order <= max_order; ++order) {
            auto offsets = neighbourhood(order, kind);
            const Offset box = difference_box(offsets);
            offsets.push_back({});
            Offset largest;
            for (const Offset a : offsets) {
                for (const Offset b : offsets) {
                    largest = {std::max(largest.row, (a - b).row), std::max(largest.column, (a - b).column)};
                }
            }
            EXPECT_EQ(box, largest);
        }
    }
    EXPECT_EQ(difference_box(neighbourhood(5, NeighbourhoodKind::causal)), (Offset{2, 4}));
    EXPECT_EQ(difference_box({}), Offset{});
    EXPECT_EQ(difference_box({{3, -7}}), (Offset{3, 7}));
}

TEST(Neighbourhood, NamesComeBack) {
    for (const NeighbourhoodKind kind : kinds) EXPECT_EQ(neighbourhood_kind(name(kind)), kind);
    EXPECT_EQ(neighbourhood_kind("custom"), NeighbourhoodKind::custom);
    EXPECT_THROW((void)neighbourhood_kind("Causal"), InputError);
    EXPECT_THROW((void)neighbourhood_kind(""), InputError);
}

TEST(Support, KnowsItsPairs) {
    Support support{NeighbourhoodKind::custom, {{0, -1}, {-1, 0}}};
    EXPECT_TRUE(support.has_all());
    EXPECT_TRUE(support.has(1, 1, 0, 2));
    support.active = {1, 1, 1, 1, 1, 1, 0, 1};  // the second offset, plane 1 beside plane 0
    EXPECT_FALSE(support.has_all());
    for (std::size_t s = 0; s < 2; ++s) {
        for (std::size_t i = 0; i < 2; ++i) {
            for (std::size_t j = 0; j < 2; ++j)
                EXPECT_EQ(support.has(s, i, j, 2), s != 1 || i != 1 || j != 0) << s << i << j;
        }
    }
    support.active.assign(8, 1);
    EXPECT_TRUE(support.has_all());
}

TEST(Neighbourhood, RefusesOrdersAndKindsThatHaveNone) {
    EXPECT_THROW((void)neighbourhood(0, NeighbourhoodKind::causal), InputError);
    EXPECT_THROW((void)neighbourhood(max_order + 1, NeighbourhoodKind::causal), InputError);
    EXPECT_THROW((void)neighbourhood(-1, NeighbourhoodKind::half), InputError);
    EXPECT_THROW((void)neighbourhood(3, NeighbourhoodKind::custom), InputError);
}

}  // namespace
}  // namespace btfield
