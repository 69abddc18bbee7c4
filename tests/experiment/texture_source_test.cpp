// Compound models and rolls among the models of an experiment.

#include "host/experiment/texture_source.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "btfield/compound.hpp"
#include "btfield/error.hpp"
#include "btfield/experiment.hpp"
#include "btfield/roller.hpp"
#include "host/experiment/picture_work.hpp"
#include "tests/experiment_cases.hpp"

namespace btfield {

using namespace detail;

namespace {

using test::comparable_rows;
using test::query_lines;
using test::TemporaryFolder;
using test::threads;
using test::varied_experiment;
using test::varied_jobs;

TEST(TextureSource, CompoundAndRollHaveRowsOfTheirOwn) {
    const TemporaryFolder folder;
    const ExperimentConfig config = read_experiment(varied_experiment(folder));
    const ExperimentResult first = run_experiment(config, folder / "1.db", threads(1));
    EXPECT_EQ(first.jobs, varied_jobs);
    EXPECT_EQ(first.done, varied_jobs);
    const std::vector<std::string> rows = comparable_rows(folder / "1.db");
    EXPECT_EQ(query_lines(folder / "1.db",
                          "SELECT model, count(*), count(memd_star), count(certified), count(DISTINCT seed) "
                          "FROM jobs GROUP BY model",
                          5),
              (std::vector<std::string>{"3d-car|4|4|4|2|", "compound|4|4|4|2|", "roll|2|2|0|2|"}));
    // Nothing is said of a model where there is none.
    EXPECT_EQ(
        query_lines(folder / "1.db",
                    "SELECT \"order\", levels, estimator, marginals, count(min_singular), count(zeros), "
                    "count(lowest_ratio), count(highest_ratio), count(estimators), count(fitted_levels), "
                    "count(parameters), count(memd), count(variance_ratio), count(clamped_pixels) "
                    "FROM jobs WHERE model = 'roll'",
                    14),
        std::vector<std::string>{"0|0|auto|any|0|0|0|0|0|0|0|2|2|2|"});
    const std::vector<ExperimentTable> tables = experiment_tables(folder / "1.db");
    ASSERT_EQ(tables.size(), 1U);
    for (const ExperimentTable::Row& row : tables[0].rows)
        EXPECT_TRUE(std::isfinite(row.all.mean)) << row.model;

    EXPECT_EQ(run_experiment(config, folder / "1.db", threads(1)).skipped, varied_jobs);
    ExperimentRunOptions one_at_a_time = threads(2);
    one_at_a_time.unit = 1;
    run_experiment(config, folder / "2.db", one_at_a_time);
    EXPECT_EQ(comparable_rows(folder / "2.db"), rows);
    // What rolls do not depend on asks for no other roll.
    ExperimentConfig other = config;
    other.models = {ExperimentModel::roll};
    other.orders = {3};
    other.marginals = {MarginalMode::none};
    const ExperimentResult again = run_experiment(other, folder / "1.db", threads(1));
    EXPECT_EQ(again.jobs, 2U);
    EXPECT_EQ(again.skipped, 2U);
}

TEST(TextureSource, RowsOfCompoundAndRollAreWhatTheStationsSay) {
    const TemporaryFolder folder;
    ExperimentConfig config = read_experiment(varied_experiment(folder));
    config.orders = {2};
    config.seeds = {7};
    config.size = Size{24, 36};
    config.noise = NoiseForm::diagonal;
    run_experiment(config, folder / "r.db", threads(1));
    const Image picture = read_picture(folder / "a.ppm").image;
    Device device;
    CompoundOptions options;
    options.local.order = 2;
    options.local.levels = 1;
    options.local.noise = NoiseForm::diagonal;
    const CompoundModel model = fit_compound(device, picture, options);
    const Image grown = CompoundSynthesiser(device, model, *config.size).synthesise(7);
    RollerOptions seed;
    seed.seed = 7;
    const Image rolled = apply(Roller(device, {&picture, 1}).quilt(*config.size, seed), picture);
    Connection connection(folder / "r.db", Connection::Access::read, "read");
    Statement row(connection,
                  "SELECT memd, certified, min_singular, zeros, lowest_ratio, highest_ratio, estimators, "
                  "fitted_levels, parameters FROM jobs WHERE model IN ('compound', 'roll') ORDER BY model");
    ASSERT_TRUE(row.step());
    EXPECT_EQ(row.real(0), memd(device, picture, as_stored(grown, PixelType::uint8)).memd);
    EXPECT_EQ(row.number(1), is_valid(model) ? 1 : 0);
    double singular = INFINITY, lowest = INFINITY, highest = 0.0;
    int zeros = 0;
    for (const CompoundRegion& region : model.regions) {
        ASSERT_EQ(region.residual.levels.size(), 1U);
        const Certificate& certificate = region.residual.levels[0].certificate;
        singular = std::min(singular, certificate.min_singular);
        zeros += certificate.zeros;
        for (const double ratio : certificate.variance_ratio) {
            lowest = std::min(lowest, ratio);
            highest = std::max(highest, ratio);
        }
    }
    EXPECT_EQ(row.real(2), singular);
    EXPECT_EQ(row.number(3), zeros);
    EXPECT_EQ(row.real(4), lowest);
    EXPECT_EQ(row.real(5), highest);
    EXPECT_EQ(row.text(6), "sr");
    EXPECT_EQ(row.number(7), 1);
    EXPECT_EQ(row.number(8), static_cast<std::int64_t>(parameter_count(model)));
    ASSERT_TRUE(row.step());
    EXPECT_EQ(row.real(0), memd(device, picture, as_stored(rolled, PixelType::uint8)).memd);
    EXPECT_FALSE(row.step());
}

TEST(TextureSource, CompoundAndRollOfAPictureThatIsTooSmallAreRefusedBeforeAnythingRuns) {
    const TemporaryFolder folder;
    ExperimentConfig config = read_experiment(varied_experiment(folder));
    config.models = {ExperimentModel::compound, ExperimentModel::roll};
    config.pictures[0].crop = Crop{0, 0, 12, 12};
    try {
        static_cast<void>(run_experiment(config, folder / "r.db", threads(1)));
        FAIL();
    } catch (const InputError& error) {
        EXPECT_NE(error.found().find("needs sides from 16"), std::string::npos) << error.what();
    }
}

}  // namespace
}  // namespace btfield
