// Runs that are ended and go on, and runs of several ranks.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/experiment.hpp"
#include "btfield/stop.hpp"
#include "tests/experiment_cases.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using test::comparable_rows;
using test::put_bytes;
using test::query_lines;
using test::small_experiment;
using test::TemporaryFolder;
using test::ThreadRanks;
using test::threads;
using test::varied_experiment;

constexpr std::uint64_t small_jobs = 24;

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

TEST(ExperimentStop, EndsAfterTheFitUnderWayAndResumes) {
    const TemporaryFolder folder;
    const ExperimentConfig config = read_experiment(small_experiment(folder));
    run_experiment(config, folder / "whole.db", threads(1));
    for (const int fits : {0, 1, 4, 9}) {
        const fs::path database = folder / ("r" + std::to_string(fits) + ".db");
        ExperimentRunOptions options = threads(1);
        // Only whether enough is in the database decides: the number of questions is nobody's business.
        options.stop = [&] {
            return fits == 0 ||
                   (fs::exists(database) && query_lines(database, "SELECT * FROM jobs", 1).size() >=
                                                static_cast<std::size_t>(2 * fits));
        };
        const ExperimentResult part = run_experiment(config, database, options);
        EXPECT_TRUE(part.interrupted);
        EXPECT_GE(part.done, static_cast<std::uint64_t>(2 * fits));
        EXPECT_LT(part.done, small_jobs);
        const ExperimentResult rest = run_experiment(config, database, threads(1));
        EXPECT_EQ(rest.skipped, part.done);
        EXPECT_EQ(rest.done, small_jobs - part.done);
        EXPECT_EQ(comparable_rows(database), comparable_rows(folder / "whole.db"));
    }
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

/// \param devices one per rank
ExperimentResult run_with_ranks(const ExperimentConfig& config, const fs::path& database,
                                const std::vector<std::string>& devices, const fs::path& textures = {}) {
    const auto size = static_cast<int>(devices.size());
    ThreadRanks post(size);
    std::vector<std::jthread> others;
    for (int r = 1; r < size; ++r) {
        others.emplace_back([&, r] {
            ThreadRanks::Rank rank(post, r);
            ExperimentRunOptions options;
            options.ranks = &rank;
            options.device = devices[static_cast<std::size_t>(r)];
            run_experiment({}, {}, options);
        });
    }
    ThreadRanks::Rank rank(post, 0);
    ExperimentRunOptions options;
    options.ranks = &rank;
    options.device = devices[0];
    options.textures = textures;
    return run_experiment(config, database, options);
}

TEST(ExperimentRanks, RanksShareTheJobs) {
    const TemporaryFolder folder;
    const ExperimentConfig config = read_experiment(small_experiment(folder));
    run_experiment(config, folder / "whole.db", threads(1));
    const ExperimentResult result = run_with_ranks(config, folder / "r.db", {"", "", ""}, folder / "best");
    EXPECT_EQ(result.done, small_jobs);
    EXPECT_EQ(comparable_rows(folder / "r.db"), comparable_rows(folder / "whole.db"));
    EXPECT_EQ(query_lines(folder / "r.db", "SELECT * FROM textures", 1).size(), 4U);
    EXPECT_EQ(run_with_ranks(config, folder / "r.db", {"", ""}).skipped, small_jobs);
}

TEST(ExperimentRanks, RanksAndShardsOfCompoundAndRoll) {
    const TemporaryFolder folder;
    ExperimentConfig config = read_experiment(varied_experiment(folder));
    config.orders = {1};
    constexpr std::uint64_t jobs = 6;
    run_experiment(config, folder / "whole.db", threads(1));
    EXPECT_EQ(run_with_ranks(config, folder / "r.db", {"", ""}).done, jobs);
    EXPECT_EQ(comparable_rows(folder / "r.db"), comparable_rows(folder / "whole.db"));
    std::vector<fs::path> parts;
    for (const int i : {1, 2}) {  // by fit
        ExperimentRunOptions options = threads(1);
        options.shard = i;
        options.shards = 2;
        parts.push_back(folder / (std::to_string(i) + ".db"));
        run_experiment(config, parts.back(), options);
    }
    EXPECT_EQ(merge_experiments(parts, folder / "m.db").done, jobs);
    EXPECT_EQ(comparable_rows(folder / "m.db"), comparable_rows(folder / "whole.db"));
}

TEST(ExperimentRanks, RankThatCannotWorkIsDoneWithout) {
    const TemporaryFolder folder;
    const ExperimentConfig config = read_experiment(small_experiment(folder));
    const std::string none = "no such device";
    EXPECT_EQ(run_with_ranks(config, folder / "1.db", {"", none}).done, small_jobs);
    EXPECT_EQ(run_with_ranks(config, folder / "2.db", {none, ""}).done, small_jobs);
    EXPECT_THROW(run_with_ranks(config, folder / "3.db", {none, none}), DeviceError);
    // Rank 0 fails before there is anything to do: the others return all the same.
    put_bytes(folder / "text.db", std::string(5000, 'x'));
    EXPECT_THROW(run_with_ranks(config, folder / "text.db", {"", ""}), InputError);
}

}  // namespace
}  // namespace btfield
