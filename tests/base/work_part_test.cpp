#include "host/base/work_part.hpp"

#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/stop.hpp"
#include "host/base/parallel.hpp"

namespace btfield {

using namespace detail;

namespace {

struct Told {
    std::vector<std::pair<std::string, double>> all;
    ProgressScope scope{[this](std::string_view stage, double share) { all.emplace_back(stage, share); }};
    [[nodiscard]] double last() const { return all.back().second; }
};

TEST(WorkParts, AddUpToTheirStage) {
    Told told;
    {
        const Stage stage("first");
        EXPECT_EQ(told.all.size(), 1U);
        EXPECT_EQ(told.last(), 0.0);
        {
            WorkPart half(0.5);
            half.done(0.5);
            EXPECT_DOUBLE_EQ(told.last(), 0.25);
            half.done(0.2);  // never back
            EXPECT_DOUBLE_EQ(told.last(), 0.25);
            {
                const WorkPart quarter(0.25);
                work_done(1.0);
                EXPECT_DOUBLE_EQ(told.last(), 0.375);
            }
        }
        work_done(0.6);  // the end of a part is that of its work: 0.5 by now
        EXPECT_DOUBLE_EQ(told.last(), 0.6);
        work_nearer(0.5);
        EXPECT_DOUBLE_EQ(told.last(), 0.8);
        EXPECT_DOUBLE_EQ(work_counted(), 0.8);
        work_done(7.0);
        EXPECT_DOUBLE_EQ(told.last(), 1.0);
    }
    const Stage stage("second");
    EXPECT_EQ(told.all.back(), (std::pair<std::string, double>{"second", 0.0}));
}

TEST(WorkParts, AreThoseOfTheThreadThatSharesItsWorkOut) {
    Told told;
    const Stage stage("blocks");
    const WorkPart half(0.5);
    for_each_part(64, [](int) { for_each_part(4, [](int) {}); });
    EXPECT_NEAR(told.last(), 0.5, 1e-9);
    double before = 0.0;
    for (const auto& [name, share] : told.all) {
        EXPECT_GE(share, before);
        before = share;
    }
    EXPECT_GT(told.all.size(), 60U);
    // Other threads are in none.
    std::jthread([] {
        EXPECT_EQ(current_part(), nullptr);
        work_done(1.0);
    }).join();
    EXPECT_NEAR(told.last(), 0.5, 1e-9);
}

TEST(WorkParts, OfStagesInsideOfStagesOnlyTheOuterOneIsTold) {
    Told told;
    const Stage outer("outer");
    const WorkPart half(0.5);
    {
        const Stage inner("inner");
        work_done(0.5);
    }
    for (const auto& [name, share] : told.all) EXPECT_EQ(name, "outer");
    EXPECT_DOUBLE_EQ(told.last(), 0.25);
}

TEST(WorkParts, TellNobodyWithoutAScope) {
    const Stage stage("alone");
    EXPECT_EQ(current_part(), nullptr);
    WorkPart part(0.5);
    EXPECT_NO_THROW(part.done(0.5));
    EXPECT_EQ(part.counted(), 0.0);
}

TEST(WorkParts, EndWhereTheCallerWantsNoMore) {
    {
        const StopScope stop([] { return true; });
        EXPECT_THROW(work_done(0.5), Stopped);
        EXPECT_THROW(work_nearer(0.5), Stopped);
        EXPECT_THROW(Stage("stopped"), Stopped);
    }
    EXPECT_EQ(current_part(), nullptr);
    struct Cancelled {};
    const ProgressScope scope([](std::string_view, double share) {
        if (share > 0.4) throw Cancelled{};
    });
    {
        const Stage stage("cancelled");
        EXPECT_THROW(for_each_part(10, [](int) {}), Cancelled);
    }
    EXPECT_EQ(current_part(), nullptr);
}

TEST(WorkParts, InnerScopesAreTold) {
    Told outer;
    {
        Told inner;
        const Stage stage("work");
        EXPECT_EQ(inner.all.size(), 1U);
    }
    EXPECT_TRUE(outer.all.empty());
    EXPECT_EQ(ProgressScope::current(), &outer.scope);
}

}  // namespace
}  // namespace btfield
