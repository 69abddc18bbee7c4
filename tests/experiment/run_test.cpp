// A StopScope around a run ends it within a fit: nothing of that fit is kept, and the next run goes on.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <string>
#include <thread>

#include "btfield/error.hpp"
#include "btfield/experiment.hpp"
#include "btfield/stop.hpp"
#include "tests/experiment_cases.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using test::comparable_rows;
using test::query_lines;
using test::small_experiment;
using test::TemporaryFolder;
using test::ThreadRanks;
using test::threads;
using test::varied_experiment;

std::size_t rows(const fs::path& database, const std::string& status) {
    if (!fs::exists(database)) return 0;
    return query_lines(database, "SELECT key FROM jobs WHERE status = '" + status + "'", 1).size();
}

/// How often a whole run asks.
int questions_of(const ExperimentConfig& config, const fs::path& database,
                 const ExperimentRunOptions& options) {
    std::atomic<int> asked{0};
    const StopScope scope([&] {
        ++asked;
        return false;
    });
    run_experiment(config, database, options);
    return asked;
}

TEST(ExperimentStop, AScopeEndsFitsUnderWayAndTheNextRunGoesOn) {
    for (const bool varied : {false, true}) {
        const TemporaryFolder folder;
        const ExperimentConfig config =
            read_experiment(varied ? varied_experiment(folder) : small_experiment(folder));
        const int all = questions_of(config, folder / "whole.db", threads(2));
        ASSERT_GT(all, 100);
        for (const int most : {0, all / 3, all / 2, all * 3 / 4}) {
            SCOPED_TRACE(most);
            const fs::path database = folder / ("part-" + std::to_string(most) + ".db");
            std::atomic<int> asked{0};
            {
                const StopScope scope([&] { return ++asked > most; });
                EXPECT_THROW(run_experiment(config, database, threads(2)), Stopped);
            }
            EXPECT_EQ(rows(database, "failed") + rows(database, "refused"), 0U);
            const std::size_t done = rows(database, "done");
            if (most == 0) {
                EXPECT_EQ(done, 0U);
            }
            if (most > all / 2) {
                EXPECT_GT(done, 0U);
            }
            EXPECT_EQ(run_experiment(config, database, threads(2)).skipped, done);
            EXPECT_EQ(comparable_rows(database), comparable_rows(folder / "whole.db"));
        }
    }
}

TEST(ExperimentStop, AScopeEndsTheKeepingOfTextures) {
    const TemporaryFolder folder;
    const ExperimentConfig config = read_experiment(small_experiment(folder));
    run_experiment(config, folder / "r.db", threads(1));
    ExperimentRunOptions options = threads(1);
    options.textures = folder / "best";
    {
        std::atomic<int> asked{0};
        const StopScope scope([&] { return ++asked > 40; });
        EXPECT_THROW(run_experiment(config, folder / "r.db", options), Stopped);
    }
    EXPECT_LT(query_lines(folder / "r.db", "SELECT * FROM textures", 1).size(), 4U);
    run_experiment(config, folder / "r.db", options);
    EXPECT_EQ(query_lines(folder / "r.db", "SELECT * FROM textures", 1).size(), 4U);
}

TEST(ExperimentStop, AScopeOfAnotherRankEndsThatRank) {
    const TemporaryFolder folder;
    const ExperimentConfig config = read_experiment(small_experiment(folder));
    run_experiment(config, folder / "whole.db", threads(1));
    ThreadRanks post(2);
    std::atomic<bool> ended{false};
    std::jthread other([&] {
        ThreadRanks::Rank rank(post, 1);
        ExperimentRunOptions options = threads(1);
        options.ranks = &rank;
        const StopScope scope([] { return true; });
        EXPECT_THROW(run_experiment({}, {}, options), Stopped);
        ended = true;
    });
    ThreadRanks::Rank rank(post, 0);
    ExperimentRunOptions options = threads(1);
    options.ranks = &rank;
    const std::thread::id caller = std::this_thread::get_id();
    options.stop = [&] {  // own work waits for the other rank's
        while (std::this_thread::get_id() != caller && !ended)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return false;
    };
    const ExperimentResult result = run_experiment(config, folder / "r.db", options);
    EXPECT_TRUE(result.interrupted);  // a picture was the other's
    EXPECT_EQ(result.failed + result.refused, 0U);
    EXPECT_LT(result.done, 24U);
    run_experiment(config, folder / "r.db", threads(1));
    EXPECT_EQ(comparable_rows(folder / "r.db"), comparable_rows(folder / "whole.db"));
}

}  // namespace
}  // namespace btfield
