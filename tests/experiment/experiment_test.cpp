// Experiments from configuration to rows: sameness, failures, shards.

#include "btfield/experiment.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <memory>
#include <set>
#include <string>

#include "btfield/criteria.hpp"
#include "btfield/error.hpp"
#include "btfield/synthesis.hpp"
#include "host/experiment/picture_work.hpp"
#include "host/experiment/results_database.hpp"
#include "tests/experiment_cases.hpp"
#include "tests/full_disk.hpp"

namespace btfield {

using namespace detail;

namespace {

namespace fs = std::filesystem;
using test::comparable_rows;
using test::put_bytes;
using test::query_lines;
using test::small_experiment;
using test::TemporaryFolder;
using test::threads;
using test::varied_experiment;
using test::whole_rows;

constexpr std::uint64_t small_jobs = 24;

std::string error_of(const ExperimentConfig& config, const fs::path& database,
                     const ExperimentRunOptions& options) {
    try {
        run_experiment(config, database, options);
    } catch (const Error& error) {
        return error.what();
    }
    return "no error";
}

TEST(Experiment, TwoRunsGiveTheSameRowsWhateverTheDivision) {
    const TemporaryFolder folder;
    const ExperimentConfig config = read_experiment(small_experiment(folder));
    const ExperimentResult first = run_experiment(config, folder / "1.db", threads(1));
    EXPECT_EQ(first.jobs, small_jobs);
    EXPECT_EQ(first.done, small_jobs);
    EXPECT_FALSE(first.interrupted);
    const std::vector<std::string> rows = comparable_rows(folder / "1.db");
    EXPECT_EQ(rows.size(), small_jobs);

    run_experiment(config, folder / "2.db", threads(2));
    EXPECT_EQ(comparable_rows(folder / "2.db"), rows);
    ExperimentRunOptions one_at_a_time = threads(1);
    one_at_a_time.unit = 1;
    run_experiment(config, folder / "3.db", one_at_a_time);
    EXPECT_EQ(comparable_rows(folder / "3.db"), rows);

    const std::vector<std::string> before = whole_rows(folder / "1.db");
    const ExperimentResult again = run_experiment(config, folder / "1.db", threads(1));
    EXPECT_EQ(again.skipped, small_jobs);
    EXPECT_EQ(again.done, 0U);
    EXPECT_EQ(whole_rows(folder / "1.db"), before);
    // Nothing is left lying about.
    for (const std::string& name : folder.names()) {
        EXPECT_EQ(name.find("-lock"), std::string::npos);
        EXPECT_EQ(name.find("-wal"), std::string::npos);
    }
}

TEST(Experiment, RowsAreWhatTheStationsSay) {
    const TemporaryFolder folder;
    const ExperimentConfig config = read_experiment(small_experiment(folder));
    run_experiment(config, folder / "r.db", threads(1));
    const Image picture = read_picture(folder / "b.ppm").image;
    Device device;
    FitOptions options;
    options.model = ModelKind::car2d;
    options.order = 2;
    options.levels = 1;
    const TextureModel model = fit(device, picture, options);
    const Image texture =
        as_stored(Synthesiser(device, model, picture.size()).synthesise(7), PixelType::uint8);
    Connection connection(folder / "r.db", Connection::Access::read, "read");
    Statement row(
        connection,
        "SELECT memd, memd_star, lag_covariance_error, certified, parameters, kappa FROM results WHERE "
        "material = 'bark' AND model = '2d-car' AND \"order\" = 2 AND seed = 7");
    ASSERT_TRUE(row.step());
    const Memd expected = memd(device, picture, texture);
    EXPECT_EQ(row.real(0), expected.memd);
    EXPECT_EQ(row.real(1), expected.memd_star);
    EXPECT_EQ(row.real(2), compare(picture, texture).lag_covariance_error);
    EXPECT_EQ(row.number(3), is_valid(model) ? 1 : 0);
    EXPECT_EQ(row.number(4), static_cast<std::int64_t>(parameter_count(model)));
    EXPECT_EQ(row.real(5), kappa(picture).kappa);
    EXPECT_FALSE(row.step());
}

TEST(Experiment, EightBitValuesAreThoseOfEightBitPictures) {
    const TemporaryFolder folder;
    test::write_texture(folder / "a.ppm", 3);
    const Image image = read_picture(folder / "a.ppm").image;
    write_picture(folder / "a.ppm", image, PixelType::uint16, PixelType::uint16);
    ExperimentConfig config;
    config.folder = folder.path();
    config.pictures = {{"m", {"a.ppm"}, {}, 0.75}};
    config.models = {ExperimentModel::car2d};
    config.orders = config.levels = {1};
    config.marginals = {MarginalMode::none};
    config.values = MeasuredValues::eight_bit;
    run_experiment(config, folder / "r.db", threads(1));
    Device device;
    const Image picture = read_picture(folder / "a.ppm").image;
    FitOptions options;
    options.model = ModelKind::car2d;
    options.order = options.levels = 1;
    options.marginals = MarginalMode::none;
    const Image texture = Synthesiser(device, fit(device, picture, options), picture.size()).synthesise(0);
    const Image steps = as_eight_bit(texture, 0.75);
    std::int64_t out = 0;
    for (std::size_t i = 0; i < area(texture.size()); ++i) {
        bool beyond = false;
        for (int p = 0; p < 3; ++p) {
            const float value = texture.plane(p)[i];
            beyond = beyond || value < 0.0F || value > 0.75F;
            const float step = std::clamp(value / 0.75F * 255.0F, 0.0F, 255.0F);
            EXPECT_LE(std::abs(steps.plane(p)[i] / 0.75F * 255.0F - step), 0.5001F);
        }
        out += beyond ? 1 : 0;
    }
    EXPECT_GT(out, 0) << "nothing to clamp: the picture tests nothing";
    Connection connection(folder / "r.db", Connection::Access::read, "read");
    Statement row(connection, "SELECT memd, clamped_pixels FROM jobs");
    ASSERT_TRUE(row.step());
    MemdOptions measure;
    measure.white = {0.75, 0.75};
    EXPECT_EQ(row.real(0),
              memd(device, as_eight_bit(picture, 0.75), as_eight_bit(texture, 0.75), measure).memd);
    EXPECT_NE(row.real(0), memd(device, picture, texture, measure).memd);
    EXPECT_EQ(row.number(1), out);
}

/// Those of the pictures in `folder`.
void expect_kept_as_measured(const TemporaryFolder& folder, const fs::path& database) {
    Device device;
    Connection connection(database, Connection::Access::read, "read");
    Statement row(
        connection,
        "SELECT t.file, j.memd, f.name, (SELECT min(memd) FROM jobs o WHERE o.picture = j.picture "
        "AND o.model = j.model) FROM textures t JOIN jobs j USING (key) JOIN files f ON f.picture = "
        "t.picture");
    while (row.step()) {
        const Image texture = read_picture(row.text(0)).image;
        EXPECT_EQ(memd(device, read_picture(folder / row.text(2)).image, texture).memd, row.real(1))
            << row.text(0);
        EXPECT_EQ(row.real(1), row.real(3));
    }
}

TEST(Experiment, KeptTexturesOfCompoundAndRollAreThoseThatWereMeasured) {
    const TemporaryFolder folder;
    const ExperimentConfig config = read_experiment(varied_experiment(folder));
    ExperimentRunOptions options = threads(1);
    options.textures = folder / "best";
    run_experiment(config, folder / "r.db", options);
    EXPECT_EQ(query_lines(folder / "r.db", "SELECT model, marginals FROM textures ORDER BY model", 2),
              (std::vector<std::string>{"3d-car|match|", "compound|match|", "roll|any|"}));
    expect_kept_as_measured(folder, folder / "r.db");
}

TEST(Experiment, KeptTexturesAreThoseThatWereMeasured) {
    const TemporaryFolder folder;
    const ExperimentConfig config = read_experiment(small_experiment(folder));
    ExperimentRunOptions options = threads(2);
    options.textures = folder / "best";
    run_experiment(config, folder / "r.db", options);
    const auto kept = [&] {
        return query_lines(
            folder / "r.db",
            "SELECT t.file, j.memd, f.name, j.model FROM textures t JOIN jobs j USING (key) JOIN files f "
            "ON f.picture = t.picture ORDER BY t.file",
            4);
    };
    ASSERT_EQ(kept().size(), 4U);  // 2 pictures, 2 models
    expect_kept_as_measured(folder, folder / "r.db");
    // One that has gone comes back, and no job is done for it.
    const std::string lost = query_lines(folder / "r.db", "SELECT file FROM textures LIMIT 1", 1)[0];
    const fs::path file = lost.substr(0, lost.size() - 1);
    const std::string bytes = test::bytes_of(file);
    fs::remove(file);
    EXPECT_EQ(run_experiment(config, folder / "r.db", options).done, 0U);
    EXPECT_EQ(test::bytes_of(file), bytes);
}

TEST(Experiment, WhatCannotBeFittedIsARowAndTheRunGoesOn) {
    const TemporaryFolder folder;
    ExperimentConfig config = read_experiment(small_experiment(folder));
    // Order 8 has room in the picture, and with four levels order 1.
    config.orders = {1, 8};
    config.levels = {1, 4};
    const ExperimentResult result = run_experiment(config, folder / "r.db", threads(1));
    EXPECT_EQ(result.done + result.refused, result.jobs);
    EXPECT_GT(result.done, 0U);
    ASSERT_GT(result.refused, 0U);
    for (const std::string& line :
         query_lines(folder / "r.db", "SELECT reason FROM jobs WHERE status = 'refused'", 1)) {
        EXPECT_NE(line.find("levels"), std::string::npos) << line;
    }
    EXPECT_EQ(run_experiment(config, folder / "r.db", threads(1)).skipped, result.jobs);
    const std::vector<ExperimentTable> tables = experiment_tables(folder / "r.db");
    ASSERT_FALSE(tables.empty());
    ASSERT_FALSE(tables[0].reasons.empty());
    EXPECT_EQ(tables[0].reasons[0].status, "refused");
    EXPECT_NE(format_tables(tables, TableFormat::text).find("levels to a picture of"), std::string::npos);
}

TEST(Experiment, WhatNoPictureHasRoomForIsRefusedBeforeAnythingRuns) {
    const TemporaryFolder folder;
    const ExperimentConfig good = read_experiment(small_experiment(folder));
    const auto refusal = [&](const ExperimentConfig& config) {
        const std::string error = error_of(config, folder / "r.db", threads(1));
        EXPECT_NE(error.find("nothing was run"), std::string::npos) << error;
        EXPECT_FALSE(fs::exists(folder / "r.db"));
        return error;
    };
    ExperimentConfig config = good;
    config.levels = {1, 9};
    EXPECT_NE(refusal(config).find("no room for 9 levels"), std::string::npos);
    EXPECT_NE(refusal(config).find("use at most "), std::string::npos);
    config = good;
    config.size = Size{20000, 16};
    EXPECT_NE(refusal(config).find("random fields grow to 16384"), std::string::npos);
    config.models = {ExperimentModel::compound};
    EXPECT_NE(refusal(config).find("compound models grow to 16384"), std::string::npos);
    for (const ExperimentModel model : {ExperimentModel::compound, ExperimentModel::roll}) {
        config.models = {ExperimentModel::car3d, model};
        config.size = Size{64, 15};
        EXPECT_NE(refusal(config).find(std::string(name(model)) + " needs 16 pixels"), std::string::npos);
    }
    config = good;
    config.models = {ExperimentModel::roll};
    config.pictures.front().crop = Crop{0, 0, 12, 30};
    EXPECT_NE(refusal(config).find("roll needs sides from 16 to 16384 pixels, and it has 12 x 30"),
              std::string::npos)
        << refusal(config);
    config = good;
    config.orders = {1, 8};
    config.levels = {4};
    EXPECT_NE(refusal(config).find("order 8"), std::string::npos);
    EXPECT_EQ(run_experiment(good, folder / "r.db", threads(1)).done, small_jobs);
    config = good;  // sizes of pictures that are known need not be read again
    config.levels = {9};
    EXPECT_NE(error_of(config, folder / "r.db", threads(1)).find("9 levels"), std::string::npos);
}

TEST(Experiment, PictureThatVanishesOrChangesFailsAndIsTriedAgain) {
    for (const bool vanish : {true, false}) {
        const TemporaryFolder folder;
        const ExperimentConfig config = read_experiment(small_experiment(folder));
        const fs::path second = folder / "b.ppm";
        const std::string bytes = test::bytes_of(second);
        bool struck = false;
        ExperimentRunOptions options = threads(1);
        // Asked before every picture and fit: the second question comes when the first picture has been read.
        std::atomic<int> questions{0};
        options.stop = [&] {
            if (++questions > 3 && !struck) {
                struck = true;
                if (vanish) {
                    fs::remove(second);
                } else {
                    put_bytes(second, bytes + " ");
                }
            }
            return false;
        };
        const ExperimentResult result = run_experiment(config, folder / "r.db", options);
        EXPECT_EQ(result.done, small_jobs / 2);
        EXPECT_EQ(result.failed, small_jobs / 2);
        EXPECT_NE(result.failure.find("b.ppm"), std::string::npos) << result.failure;
        EXPECT_EQ(query_lines(folder / "r.db", "SELECT * FROM jobs WHERE status = 'failed'", 1).size(),
                  small_jobs / 2);

        put_bytes(second, bytes);
        const ExperimentResult again = run_experiment(config, folder / "r.db", threads(1));
        EXPECT_EQ(again.skipped, small_jobs / 2);
        EXPECT_EQ(again.done, small_jobs / 2);
        run_experiment(config, folder / "whole.db", threads(1));
        EXPECT_EQ(comparable_rows(folder / "r.db"), comparable_rows(folder / "whole.db"));
    }
}

TEST(Experiment, MissingPictureIsSaidBeforeAnyWork) {
    const TemporaryFolder folder;
    const ExperimentConfig config = read_experiment(small_experiment(folder));
    fs::remove(folder / "b.ppm");
    EXPECT_NE(error_of(config, folder / "r.db", threads(1)).find("b.p?m"), std::string::npos);
    EXPECT_FALSE(fs::exists(folder / "r.db"));
}

TEST(Experiment, PicturesAndCropsAreCheckedBeforeAnythingRuns) {
    const TemporaryFolder folder;
    ExperimentConfig config = read_experiment(small_experiment(folder));
    const fs::path database = folder / "r.db";
    run_experiment(config, database, threads(1));
    const std::string before = test::bytes_of(database);
    const auto refusal = [&](const fs::path& path) {
        try {
            run_experiment(config, path, threads(1));
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string("ran");
    };
    config.pictures[1].crop = Crop{20, 0, 32, 32};  // of 40 x 32 pixels
    for (const fs::path& path : {database, folder / "new.db"}) {
        const std::string said = refusal(path);
        EXPECT_NE(said.find("'b.ppm' of bark, crop [20,0,32,32]"), std::string::npos) << said;
        EXPECT_NE(said.find("leaves the picture of 40x32 pixels"), std::string::npos) << said;
        EXPECT_EQ(said.find('\n'), std::string::npos) << said;
    }
    EXPECT_EQ(test::bytes_of(database), before);
    EXPECT_FALSE(fs::exists(folder / "new.db"));
    // A file that is no picture, and how many more there are.
    config.pictures[0].crop = Crop{20, 0, 32, 32};
    test::put_bytes(folder / "b.ppm", "P6 no picture");
    const std::string said = refusal(folder / "new.db");
    EXPECT_NE(said.find("'a.ppm' of stone"), std::string::npos) << said;
    EXPECT_NE(said.find("(and another picture fails)"), std::string::npos) << said;
    config.pictures[0].crop.reset();
    EXPECT_NE(refusal(database).find("'b.ppm' of bark"), std::string::npos);
    EXPECT_FALSE(fs::exists(folder / "new.db"));
}

TEST(Experiment, ShardsMergeToTheWhole) {
    const TemporaryFolder folder;
    const ExperimentConfig config = read_experiment(small_experiment(folder));
    run_experiment(config, folder / "whole.db", threads(1));
    for (const int shards : {2, 3}) {  // by picture; by fit
        std::vector<fs::path> parts;
        std::uint64_t jobs = 0;
        for (int i = 1; i <= shards; ++i) {
            ExperimentRunOptions options = threads(1);
            options.shard = i;
            options.shards = shards;
            parts.push_back(folder / (std::to_string(i) + "-of-" + std::to_string(shards) + ".db"));
            jobs += run_experiment(config, parts.back(), options).done;
        }
        EXPECT_EQ(jobs, small_jobs);
        const fs::path merged = folder / ("merged" + std::to_string(shards) + ".db");
        const ExperimentResult result = merge_experiments(parts, merged);
        EXPECT_EQ(result.jobs, small_jobs);
        EXPECT_EQ(result.done, small_jobs);
        EXPECT_EQ(comparable_rows(merged), comparable_rows(folder / "whole.db"));
        EXPECT_THROW(merge_experiments(parts, merged), InputError);
        EXPECT_EQ(run_experiment(config, merged, threads(1)).skipped, small_jobs);
    }
    EXPECT_THROW(merge_experiments({folder / "absent.db"}, folder / "new.db"), InputError);
    EXPECT_FALSE(fs::exists(folder / "new.db"));
}

TEST(Experiment, DatabaseOfAnotherRunOrProgramOrDamaged) {
    const TemporaryFolder folder;
    const ExperimentConfig config = read_experiment(small_experiment(folder));
    {
        const RunLock lock(folder / "r.db", "hold it");
        EXPECT_NE(error_of(config, folder / "r.db", threads(1)).find("another run"), std::string::npos);
    }
    run_experiment(config, folder / "r.db", threads(1));
    const std::string good = test::bytes_of(folder / "r.db");

    put_bytes(folder / "text.db", std::string(5000, 'x'));
    EXPECT_NE(error_of(config, folder / "text.db", threads(1)).find("no SQLite database"), std::string::npos);
    EXPECT_THROW(static_cast<void>(experiment_tables(folder / "text.db")), InputError);
    EXPECT_EQ(test::bytes_of(folder / "text.db"), std::string(5000, 'x'));

    { Connection(folder / "other.db", Connection::Access::create, "make").execute("CREATE TABLE t(x)"); }
    EXPECT_NE(error_of(config, folder / "other.db", threads(1)).find("no database of experiments"),
              std::string::npos);

    { Connection(folder / "r.db", Connection::Access::write, "change").execute("PRAGMA user_version = 99"); }
    EXPECT_NE(error_of(config, folder / "r.db", threads(1)).find("version 99"), std::string::npos);

    // Any page overwritten, the file cut anywhere: an error, or at least no crash and no wrong row.
    put_bytes(folder / "good.db", good);
    const std::vector<std::string> rows = comparable_rows(folder / "good.db");
    int refused = 0;
    constexpr std::size_t page = 4096;
    for (std::size_t at = 0; at + page <= good.size(); at += page) {
        std::string bad = good;
        bad.replace(at, page, std::string(page, '\xA5'));
        put_bytes(folder / "bad.db", bad);
        try {
            static_cast<void>(experiment_tables(folder / "bad.db"));
            EXPECT_EQ(comparable_rows(folder / "bad.db"), rows);
        } catch (const InputError& error) {
            ++refused;
            EXPECT_NE(std::string(error.what()).find("database"), std::string::npos) << error.what();
        }
    }
    EXPECT_GE(refused, 5);
    put_bytes(folder / "bad.db", good.substr(0, good.size() / 2));
    EXPECT_NE(error_of(config, folder / "bad.db", threads(1)).find("damaged"), std::string::npos);
}

TEST(Experiment, FullDiskKeepsWhatWasCommitted) {
    const TemporaryFolder folder;
    const ExperimentConfig config = read_experiment(small_experiment(folder));
    run_experiment(config, folder / "whole.db", threads(1));
    int failures = 0;
    for (const int kilobytes : {4, 40, 70, 90}) {
        {
            const test::FullDisk disk(static_cast<rlim_t>(kilobytes) << 10);
            try {
                run_experiment(config, folder / "r.db", threads(1));
            } catch (const InputError& error) {
                ++failures;
                EXPECT_NE(std::string(error.what()).find("space"), std::string::npos) << error.what();
            }
        }
    }
    EXPECT_GE(failures, 2);
    run_experiment(config, folder / "r.db", threads(1));
    EXPECT_EQ(comparable_rows(folder / "r.db"), comparable_rows(folder / "whole.db"));
}

TEST(Experiment, NoDevice) {
    const TemporaryFolder folder;
    const ExperimentConfig config = read_experiment(small_experiment(folder));
    ExperimentRunOptions options = threads(2);
    options.device = "no such device";
    EXPECT_THROW(run_experiment(config, folder / "r.db", options), DeviceError);
}

}  // namespace
}  // namespace btfield
