// host/experiment/forget.cpp, and which jobs belong to a configuration (host/experiment/scope.cpp).

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/experiment.hpp"
#include "host/experiment/results_database.hpp"
#include "tests/experiment_cases.hpp"

namespace btfield {

using namespace detail;

namespace {

namespace fs = std::filesystem;
using test::query_lines;
using test::small_experiment;
using test::TemporaryFolder;
using test::threads;

std::size_t jobs_in(const fs::path& database) {
    return query_lines(database, "SELECT key FROM jobs", 1).size();
}

class Forget : public testing::Test {
  protected:
    void SetUp() override {
        config_ = read_experiment(small_experiment(folder_));
        ExperimentRunOptions options = threads(1);
        options.textures = folder_ / "best";
        ASSERT_EQ(run_experiment(config_, database_, options).done, 24U);
    }
    [[nodiscard]] ForgottenJobs forget(ExperimentForget which) const {
        which.dry_run = true;
        const std::string before = test::bytes_of(database_);
        const ForgottenJobs told = forget_jobs(database_, which);
        EXPECT_EQ(test::bytes_of(database_), before) << "a dry run changed the database";
        which.dry_run = false;
        const ForgottenJobs forgotten = forget_jobs(database_, which);
        EXPECT_EQ(forgotten.jobs, told.jobs);
        EXPECT_EQ(forgotten.left, told.left);
        EXPECT_EQ(forgotten.textures, told.textures);
        EXPECT_EQ(jobs_in(database_), forgotten.left);
        return forgotten;
    }

    TemporaryFolder folder_;
    fs::path database_ = folder_ / "r.db";
    ExperimentConfig config_;
};

TEST_F(Forget, WhatMeetsEveryConditionGoesAndComesBack) {
    ExperimentForget which;
    which.pictures = {"b.ppm"};
    which.models = {ExperimentModel::car3d};
    which.orders = {1, 3};
    which.seeds = {5};
    const ForgottenJobs forgotten = forget(which);
    EXPECT_EQ(forgotten.jobs, 2U);
    EXPECT_EQ(forgotten.done, 2U);
    ASSERT_EQ(forgotten.parts.size(), 1U);
    EXPECT_EQ(forgotten.parts[0].picture, "b.ppm");
    EXPECT_EQ(forgotten.parts[0].model, "3d-car");
    EXPECT_EQ(forgotten.parts[0].done, 2U);
    const ExperimentResult again = run_experiment(config_, database_, threads(1));
    EXPECT_EQ(again.done, 2U);
    EXPECT_EQ(again.skipped, 22U);
}

TEST_F(Forget, APictureWithAllThatIsKnownOfIt) {
    ExperimentForget which;
    which.materials = {"bark"};
    const ForgottenJobs forgotten = forget(which);
    EXPECT_EQ(forgotten.jobs, 12U);
    EXPECT_EQ(forgotten.textures, 2U);
    EXPECT_EQ(query_lines(database_, "SELECT picture FROM pictures", 1).size(), 1U);
    EXPECT_EQ(query_lines(database_, "SELECT file FROM textures", 1).size(), 2U);
    EXPECT_EQ(forget(ExperimentForget{.pictures = {"b.*"}}).jobs, 0U) << "known, but there is none any more";
}

TEST_F(Forget, WhatItDoesNotFind) {
    const auto refusal = [&](const ExperimentForget& which) {
        try {
            static_cast<void>(forget_jobs(database_, which));
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string("done");
    };
    EXPECT_NE(refusal({}).find("nothing says which"), std::string::npos);
    EXPECT_NE(refusal({.pictures = {"c.ppm"}}).find("no picture is called 'c.ppm'"), std::string::npos);
    EXPECT_NE(refusal({.materials = {"wool"}}).find("no material is called 'wool'"), std::string::npos);
    EXPECT_EQ(jobs_in(database_), 24U);
    EXPECT_THROW(static_cast<void>(forget_jobs(folder_ / "none.db", {.failed = true})), InputError);
    EXPECT_FALSE(fs::exists(folder_ / "none.db"));
    const RunLock lock(database_, "hold it");
    EXPECT_NE(refusal({.stale = true}).find("another run"), std::string::npos);
}

TEST_F(Forget, WhatTheConfigurationHasNoLonger) {
    // A crop and fewer orders: other pictures and settings than before.
    test::put_bytes(folder_ / "small.json", R"json({
        "pictures": [{"material": "stone", "files": ["a.ppm"], "crop": [0, 0, 32, 32]}, {"material": "bark", "files": ["b.ppm"]}],
        "models": ["3d-car", "2d-car"], "orders": [2], "levels": [1], "seeds": [5, 7]
    })json");
    const ExperimentConfig config = read_experiment(folder_ / "small.json");
    EXPECT_EQ(run_experiment(config, database_, threads(1)).skipped, 4U);
    std::vector<ExperimentTable> tables = experiment_tables(database_);
    ASSERT_EQ(tables.size(), 1U);
    EXPECT_EQ(tables[0].done, 8U);
    EXPECT_EQ(tables[0].pictures, (std::vector<int>{1, 1}));
    EXPECT_EQ(tables[0].all_pictures, 2);
    const ForgottenJobs forgotten = forget({.stale = true});
    EXPECT_EQ(forgotten.jobs, 20U);
    EXPECT_EQ(experiment_tables(database_).at(0).done, 8U);
    EXPECT_EQ(experiment_contents(database_).configurations.size(), 2U) << "the first one shares four jobs";
    EXPECT_EQ(forget({.stale = true}).jobs, 0U);
    EXPECT_EQ(run_experiment(config, database_, threads(1)).skipped, 8U);
}

/// A database that knows neither runs nor members: what they say is found from the configuration's text.
TEST_F(Forget, DatabasesOfOlderVersions) {
    const auto counts = [&] {
        std::vector<std::uint64_t> all;
        for (const auto& configuration : experiment_contents(database_).configurations)
            all.push_back(configuration.jobs);
        return all;
    };
    const std::vector<ExperimentTable> tables = experiment_tables(database_);
    EXPECT_EQ(counts(), std::vector<std::uint64_t>{24});
    {
        Connection old(database_, Connection::Access::write, "make it old");
        old.execute("DROP TABLE runs; DROP TABLE members; DROP TABLE wanted; DROP TABLE places");
    }
    EXPECT_EQ(counts(), std::vector<std::uint64_t>{24});
    const std::vector<ExperimentTable> old = experiment_tables(database_);
    EXPECT_EQ(format_tables(old, TableFormat::csv), format_tables(tables, TableFormat::csv));
    // Its configuration with another picture beside, that has no file any more.
    {
        Connection connection(database_, Connection::Access::write, "add to it");
        connection.execute(
            "INSERT INTO files SELECT folder, 'c.ppm', crop, material, white, content, 'c' FROM files WHERE "
            "name = 'a.ppm'");
    }
    EXPECT_EQ(experiment_tables(database_).at(0).all_pictures, 2);
    EXPECT_EQ(run_experiment(config_, database_, threads(1)).skipped, 24U);
    EXPECT_EQ(counts(), std::vector<std::uint64_t>{24});
}

TEST_F(Forget, MergedDatabasesKeepTheirConfiguration) {
    const TemporaryFolder other;
    ExperimentRunOptions options = threads(1);
    std::vector<fs::path> parts;
    for (const int i : {1, 2}) {
        options.shard = i;
        options.shards = 2;
        parts.push_back(other / (std::to_string(i) + ".db"));
        run_experiment(config_, parts.back(), options);
        EXPECT_EQ(experiment_tables(parts.back()).at(0).all_pictures, 2) << "of which it has one";
    }
    merge_experiments(parts, other / "all.db");
    EXPECT_EQ(format_tables(experiment_tables(other / "all.db"), TableFormat::csv),
              format_tables(experiment_tables(database_), TableFormat::csv));
}

/// Configuration, pictures, database and textures in one folder that is moved: the page shows all of them.
TEST_F(Forget, TheReportFindsPicturesThatMovedAlong) {
    const auto count_of = [](const std::string& text, const std::string& part) {
        std::size_t count = 0;
        for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
        return count;
    };
    const TemporaryFolder elsewhere;
    fs::create_directories(folder_ / "sub/results");
    for (const char* suffix : {"", "-wal", "-shm"})
        if (fs::exists(database_.string() + suffix)) fs::remove(database_.string() + suffix);
    ExperimentRunOptions options = threads(1);
    options.textures = folder_ / "sub/best";
    run_experiment(config_, folder_ / "sub/results/r.db", options);
    fs::rename(folder_ / "sub", elsewhere / "sub");
    for (const char* file : {"a.ppm", "b.ppm", "small.json"}) fs::rename(folder_ / file, elsewhere / file);
    write_experiment_report(elsewhere / "sub/results/r.db", elsewhere / "page.html");
    std::string html = test::bytes_of(elsewhere / "page.html");
    EXPECT_EQ(count_of(html, "<img "), 6U);  // two pictures, two textures of each
    EXPECT_EQ(count_of(html, ">not at hand<"), 0U);
    // The database alone: what stayed is found where it was.
    fs::copy_file(elsewhere / "sub/results/r.db", folder_ / "alone.db");
    for (const char* file : {"a.ppm", "b.ppm"}) fs::copy_file(elsewhere / file, folder_ / file);
    write_experiment_report(folder_ / "alone.db", elsewhere / "page.html");
    EXPECT_EQ(count_of(test::bytes_of(elsewhere / "page.html"), "<img "), 2U);
    // Another picture in the place of one is not shown as that one.
    test::write_texture(elsewhere / "a.ppm", 77);
    fs::remove(folder_ / "a.ppm");
    write_experiment_report(elsewhere / "sub/results/r.db", elsewhere / "page.html");
    html = test::bytes_of(elsewhere / "page.html");
    EXPECT_EQ(count_of(html, "<img "), 5U);
    EXPECT_EQ(count_of(html, ">not at hand<"), 1U);
}

}  // namespace
}  // namespace btfield
