// Experiments over the pictures of BTF sets.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include "btfield/btf_model.hpp"
#include "btfield/btf_output.hpp"
#include "btfield/criteria.hpp"
#include "btfield/error.hpp"
#include "btfield/experiment.hpp"
#include "btfield/height.hpp"
#include "btfield/made_btf.hpp"
#include "btfield/synthesis.hpp"
#include "host/experiment/angles.hpp"
#include "host/experiment/messages.hpp"
#include "host/experiment/results_database.hpp"
#include "host/experiment/set_pictures.hpp"
#include "host/experiment/sqlite.hpp"
#include "tests/device_cases.hpp"
#include "tests/experiment_cases.hpp"
#include "tests/places.hpp"

namespace btfield {

using namespace detail;

namespace {

namespace fs = std::filesystem;
using test::comparable_rows;
using test::put_bytes;
using test::query_lines;
using test::TemporaryFolder;
using test::threads;

constexpr Size side{24, 28};

/// From above, and six around at 30 degrees.
std::vector<BtfDirection> seven() {
    std::vector<BtfDirection> all{{}};
    for (int k = 0; k < 6; ++k) all.push_back({from_degrees(30.0), from_degrees(60.0 * k)});
    return all;
}

/// Bumps of two colours.
BtfMaterial bumps(Size size = side, int planes = 3) {
    BtfMaterial m;
    m.height = Image(size, 1);
    m.albedo = Image(size, planes, planes == 3 ? ColourSpace::linear : ColourSpace::unspecified);
    unsigned state = 7;
    float before = 0.0F;
    for (int r = 0; r < size.height; ++r)
        for (int c = 0; c < size.width; ++c) {
            state = state * 1664525U + 1013904223U;
            before = 0.3F * before + 0.7F * static_cast<float>(state >> 8) * 0x1p-24F;
            m.height.at(0, r, c) = before;
            for (int p = 0; p < planes; ++p)
                m.albedo.at(p, r, c) = 0.2F + 0.1F * static_cast<float>(p % 5) +
                                       0.3F * static_cast<float>((state >> (8 + p % 8)) & 255U) / 255.0F;
        }
    m.normals = normals_of_slopes(slopes_of_height(m.height, SurfaceEdges::periodic));
    return m;
}

/// A folder with the set `bumps` of 49 pictures, EXR, and a configuration.
class BtfExperiment : public testing::Test {
  protected:
    BtfExperiment() {
        write_set(folder_ / "bumps", bumps());
        config_ = config(R"("directions": {"number": 6, "seed": 3})");
    }
    void write_set(const fs::path& path, const BtfMaterial& material, BtfFormat format = BtfFormat::utia) {
        MadeBtfOptions how;
        how.views = how.lights = seven();
        BtfWriteOptions options;
        options.format = format;
        options.type = PixelType::half;
        static_cast<void>(write_btf(path, make_btf(device_, material, how), options));
    }
    /// \param entry of the pictures, but for material and set
    [[nodiscard]] ExperimentConfig config(const std::string& entry, const std::string& set = "bumps",
                                          const std::string& models = R"("2d-car")") const {
        put_bytes(folder_ / "e.json", R"({"pictures": [{"material": "m", "btf": ")" + set + "\", " + entry +
                                          R"(}], "models": [)" + models +
                                          R"(], "orders": [1, 2], "levels": [1], "seeds": [5]})");
        return read_experiment(folder_ / "e.json");
    }
    [[nodiscard]] std::string refusal(const ExperimentConfig& config) const {
        try {
            run_experiment(config, folder_ / "refused.db", threads(1));
        } catch (const InputError& error) {
            EXPECT_FALSE(fs::exists(folder_ / "refused.db"));
            return error.what();
        }
        return "no error";
    }
    void fit_model(const fs::path& path, int planes = 4) {
        BtfFitOptions options;
        options.planes = planes;
        options.periodic = true;
        options.field.order = options.field.levels = 1;
        write_btf_model(path, fit_btf(device_, BtfSet::open(folder_ / "bumps"), options).model);
    }

    const TemporaryFolder folder_;
    Device device_ = test::device_of_width(8);
    ExperimentConfig config_;
};

TEST_F(BtfExperiment, PicturesAreThoseOfTheSetAndASecondRunHasNothingToDo) {
    const fs::path database = folder_ / "r.db";
    EXPECT_EQ(run_experiment(config_, database, threads(1)).done, 12U);
    EXPECT_EQ(run_experiment(config_, database, threads(1)).skipped, 12U);
    run_experiment(config_, folder_ / "two.db", threads(2));
    EXPECT_EQ(comparable_rows(folder_ / "two.db"), comparable_rows(database));

    OpenSets sets;
    const std::vector<PictureSource> sources = picture_sources(config_, sets);
    ASSERT_EQ(sources.size(), 6U);
    const PictureSource& source = sources[2];
    ASSERT_TRUE(source.direction.has_value());
    EXPECT_EQ(source.name, "bumps " + directions_text(source.direction->at));
    EXPECT_EQ(source.white, 1.0);
    // Linear light, as the set gives it.
    const Image picture = read_direction(sets, folder_ / "bumps", *source.direction, {});
    EXPECT_EQ(picture.space(), ColourSpace::linear);
    FitOptions options;
    options.model = ModelKind::car2d;
    options.order = options.levels = 1;
    const Image texture = Synthesiser(device_, fit(device_, picture, options), picture.size()).synthesise(5);
    Connection connection(database, Connection::Access::read, "read");
    Statement row(connection,
                  "SELECT memd, kappa, variance_ratio FROM results WHERE name = ? AND \"order\" = 1");
    row.bind(source.name);
    ASSERT_TRUE(row.step());
    EXPECT_NEAR(row.real(0), memd(device_, picture, texture).memd, 1e-3);
    EXPECT_EQ(row.real(1), kappa(picture).kappa);
    double ratio = 0.0;
    for (const auto& plane : compare(picture, texture).planes)
        ratio += plane.std_ratio * plane.std_ratio / 3.0;
    EXPECT_NEAR(row.real(2), ratio, 1e-4);
}

TEST_F(BtfExperiment, TheSamePicturesOfAnotherContainerAreTheSameJobs) {
    run_experiment(config_, folder_ / "r.db", threads(1));
    write_set(folder_ / "one.tbig", bumps(), BtfFormat::tbig);
    write_set(folder_ / "packed.zip", bumps());
    for (const char* set : {"one.tbig", "packed.zip", "bumps/"}) {
        const ExperimentConfig other = config(R"("directions": {"number": 6, "seed": 3})", set);
        EXPECT_EQ(run_experiment(other, folder_ / "r.db", threads(1)).skipped, 12U) << set;
    }
}

TEST_F(BtfExperiment, PicturesThatDidNotChangeAreNotReadAgain) {
    KnownPictures known;
    {
        OpenSets sets;
        static_cast<void>(picture_sources(config_, sets, &known));
        // Files that are a moment old could change once more and look the same.
        EXPECT_TRUE(known.empty());
    }
    write_set(folder_ / "one.tbig", bumps(), BtfFormat::tbig);
    std::this_thread::sleep_for(std::chrono::milliseconds(2100));
    OpenSets sets;
    const std::vector<PictureSource> sources = picture_sources(config_, sets, &known);
    ASSERT_EQ(known.size(), 6U);
    KnownPictures marked = known;
    for (auto& [place, picture] : marked) picture.content = "as it was";
    for (const PictureSource& source : picture_sources(config_, sets, &marked)) {
        EXPECT_EQ(source.content, "as it was");
        EXPECT_EQ(source.shape->size, side);
    }
    // Other readings are others; so is a file that was written anew, though with the same content.
    const ExperimentConfig cropped =
        config(R"("directions": {"number": 6, "seed": 3}, "crop": [0, 0, 16, 16])");
    EXPECT_EQ(picture_sources(cropped, sets, &marked)[0].shape->size, (Size{16, 16}));
    const DirectionSource& first = *sources[0].direction;
    const std::string stamp = stamp_of_direction(sets, folder_ / "bumps", first, {});
    for (const auto& file : fs::recursive_directory_iterator(folder_ / "bumps"))
        if (file.is_regular_file())
            fs::last_write_time(file, fs::last_write_time(file) - std::chrono::hours(1));
    EXPECT_NE(stamp_of_direction(sets, folder_ / "bumps", first, {}), stamp);
    for (const PictureSource& source : picture_sources(config_, sets, &marked))
        EXPECT_EQ(source.content.size(), 64U);
    // Files of all pictures.
    OpenSets others;
    const ExperimentConfig single = config(R"("directions": {"number": 6, "seed": 3})", "one.tbig");
    KnownPictures of_file;
    EXPECT_EQ(picture_sources(single, others, &of_file)[0].content, sources[0].content);
    EXPECT_EQ(of_file.size(), 6U);
    // In the database: the second run knows them.
    const fs::path database = folder_ / "r.db";
    run_experiment(single, database, threads(1));
    ResultsDatabase kept(database, "read");
    EXPECT_EQ(kept.known_pictures().size(), 6U);
    EXPECT_EQ(kept.known_pictures().begin()->second.content, of_file.begin()->second.content);
}

TEST_F(BtfExperiment, OnlyWhatIsAskedForIsRead) {
    OpenSets sets;
    const std::vector<PictureSource> sources = picture_sources(config_, sets);
    int broken = 0;
    const BtfSet set = BtfSet::open(folder_ / "bumps");
    for (const auto& file : fs::recursive_directory_iterator(folder_ / "bumps")) {
        if (file.path().extension() != ".exr" || file.path().filename() == "height.exr") continue;
        const bool used = std::ranges::any_of(sources, [&](const PictureSource& source) {
            const auto degree = [](double angle) { return std::to_string(std::lround(in_degrees(angle))); };
            const auto padded = [&](double angle) {
                return std::string(3 - degree(angle).size(), '0') + degree(angle);
            };
            const ExperimentDirections& at = source.direction->at;
            const std::string name = file.path().filename().string();
            return name.find("tl" + padded(at.light.theta) + "_pl" + padded(at.light.phi)) !=
                       std::string::npos &&
                   name.find("tv" + padded(at.view.theta) + "_pv" + padded(at.view.phi)) != std::string::npos;
        });
        // The first tells size and planes of all.
        if (used || file.path().filename().string().find("tl000_pl000_tv000_pv000") != std::string::npos)
            continue;
        put_bytes(file.path(), "no picture");
        ++broken;
    }
    EXPECT_GE(broken, 42);
    EXPECT_EQ(run_experiment(config_, folder_ / "r.db", threads(1)).done, 12U);
    // One that is asked for is named, and nothing is run.
    const std::string said = refusal(config(R"("directions": "all")"));
    EXPECT_NE(said.find("experiment with 'bumps view "), std::string::npos) << said;
    EXPECT_NE(said.find("nothing was run"), std::string::npos) << said;
}

TEST_F(BtfExperiment, ShardsMergeToTheWhole) {
    run_experiment(config_, folder_ / "whole.db", threads(1));
    std::vector<fs::path> parts;
    ExperimentRunOptions options = threads(1);
    options.shards = 2;
    for (options.shard = 1; options.shard <= 2; ++options.shard) {
        parts.push_back(folder_ / ("part" + std::to_string(options.shard) + ".db"));
        EXPECT_EQ(run_experiment(config_, parts.back(), options).done, 6U);
    }
    merge_experiments(parts, folder_ / "merged.db");
    EXPECT_EQ(comparable_rows(folder_ / "merged.db"), comparable_rows(folder_ / "whole.db"));
    ExperimentTableOptions by_picture;
    by_picture.by_picture = true;
    EXPECT_EQ(format_tables(experiment_tables(folder_ / "merged.db", by_picture), TableFormat::csv),
              format_tables(experiment_tables(folder_ / "whole.db", by_picture), TableFormat::csv));
}

TEST_F(BtfExperiment, RanksAreToldDirections) {
    OpenSets sets;
    const ExperimentConfig cropped = config(R"("directions": [{"view": [30, 60], "light": [30, -60]}],
        "crop": [2, 3, 20, 18], "pixel_stride": 2, "coding": "linear", "colour": "xyz")");
    RankMessage message;
    message.kind = MessageKind::unit;
    message.unit = WorkUnit{picture_sources(cropped, sets).at(0), job_settings(cropped), false};
    message.unit->source.direction->model = "a.btfm";
    message.unit->source.direction->model_content = "c";
    const RankMessage arrived = rank_message(to_bytes(message));
    ASSERT_TRUE(arrived.unit.has_value());
    const PictureSource& sent = message.unit->source;
    const PictureSource& source = arrived.unit->source;
    ASSERT_TRUE(source.direction.has_value());
    EXPECT_EQ(source.name, "bumps view 30,60 light 30,300 stride 2");
    EXPECT_EQ(source.direction->at, sent.direction->at);
    EXPECT_EQ(source.direction->true_light, sent.direction->true_light);
    EXPECT_EQ(source.direction->set_name, "bumps");
    EXPECT_EQ(source.direction->model, "a.btfm");
    EXPECT_EQ(source.direction->model_content, "c");
    EXPECT_EQ(reading_text(source.direction->reading), reading_text(sent.direction->reading));
    EXPECT_EQ(source.direction->reading.space, ColourSpace::xyz);
    EXPECT_EQ(crop_text(source.crop), "2,3,20,18");
    const Image image = read_direction(sets, source.file, *source.direction, source.crop);
    EXPECT_EQ(sha256_of_values(image), source.content);
    EXPECT_EQ(image.size(), (Size{9, 10}));
    EXPECT_EQ(arrived.unit->jobs, message.unit->jobs);
}

TEST_F(BtfExperiment, RefusedBeforeAnythingRuns) {
    const auto expect = [&](const ExperimentConfig& config, const std::string& part) {
        const std::string said = refusal(config);
        EXPECT_NE(said.find(part), std::string::npos) << said;
        EXPECT_EQ(said.find('\n'), std::string::npos) << said;
    };
    const std::string all = R"("directions": "all")";
    expect(config(all, "absent"), "experiment with the BTF 'absent' of m");
    expect(config(R"("directions": [{"view": [31, 60], "light": [0, 0]}])"),
           "it has no view 31,60; correct the configuration: the nearest is 30,60");
    expect(config(R"("directions": [{"view": [0, 0], "light": [30, 61]}])"), "it has no light 30,61");
    expect(config(R"("directions": {"number": 50})"), "it has 49 pictures, and 50 are asked for");
    expect(config(R"("directions": [{"view": [0, 0], "light": [0, 0]}, {"view": [0, 9], "light": [0, 0]}])"),
           "'bumps view 0,0 light 0,0' is named twice");
    expect(config(all + R"(, "crop": [0, 0, 29, 24])"), "experiment with the BTF 'bumps' of m");
    expect(config(all + R"(, "btf_model": "absent.btfm")", "bumps", R"("btf")"), "absent.btfm");
    expect(config(all, "bumps", R"("btf")"), "the pictures of m have none");
    write_set(folder_ / "spectral", bumps({8, 8}, 40), BtfFormat::spectral);
    expect(config(all, "spectral", R"("2d-car", "3d-car")"), "its 40 planes are too many for 3d-car");
    EXPECT_NO_THROW(
        run_experiment(config(R"("directions": {"number": 1})", "spectral"), folder_ / "s.db", threads(1)));
    for (const auto& file : fs::recursive_directory_iterator(folder_ / "bumps"))
        if (file.path().filename().string().find("tl030_pl060_tv030_pv060") != std::string::npos) {
            fs::remove(file.path());
            break;
        }
    expect(config(R"("directions": [{"view": [30, 60], "light": [30, 60]}])"),
           "it has no picture of view 30,60 light 30,60");
}

TEST_F(BtfExperiment, TablesTellDirections) {
    run_experiment(config_, folder_ / "r.db", threads(1));
    ExperimentTableOptions options;
    options.by_picture = true;
    const std::vector<ExperimentTable> tables = experiment_tables(folder_ / "r.db", options);
    ASSERT_EQ(tables.size(), 1U);
    const ExperimentTable& table = tables[0];
    EXPECT_EQ(table.pictures, std::vector<int>{6});
    ASSERT_EQ(table.picture_rows.size(), 6U);
    double sum = 0.0;
    for (std::size_t i = 0; i < 6; ++i) {
        const ExperimentTable::PictureRow& row = table.picture_rows[i];
        ASSERT_TRUE(row.directions.has_value());
        EXPECT_EQ(row.picture, "bumps " + directions_text(*row.directions));
        sum += row.best[0];
        // The ratio is that of the texture that is the best.
        const std::vector<std::string> best =
            query_lines(folder_ / "r.db",
                        "SELECT memd_star, sqrt(variance_ratio) FROM results WHERE name = '" + row.picture +
                            "' ORDER BY memd_star LIMIT 1",
                        2);
        const std::size_t bar = best.at(0).find('|');
        EXPECT_NEAR(std::stod(best[0]), row.best[0], 1e-9);
        EXPECT_NEAR(std::stod(best[0].substr(bar + 1)), row.std_ratio[0], 1e-9);
        if (i == 0) continue;
        const ExperimentDirections &before = *table.picture_rows[i - 1].directions, now = *row.directions;
        EXPECT_LT(std::tuple(before.view.theta, before.view.phi, before.light.theta, before.light.phi),
                  std::tuple(now.view.theta, now.view.phi, now.light.theta, now.light.phi));
    }
    EXPECT_NEAR(table.rows.at(0).all.mean, sum / 6.0, 1e-12);
    const std::string csv = format_tables(tables, TableFormat::csv);
    EXPECT_NE(csv.find(",estimator,picture,view_theta,view_phi,light_theta,light_phi,std_ratio\n"),
              std::string::npos);
    const ExperimentDirections& first = *table.picture_rows[0].directions;
    const auto number = [](double angle) { return std::to_string(std::lround(in_degrees(angle))); };
    EXPECT_NE(csv.find("\"bumps " + directions_text(first) + "\"," + number(first.view.theta) + "," +
                       number(first.view.phi) + "," + number(first.light.theta) + "," +
                       number(first.light.phi) + ",0."),
              std::string::npos)
        << csv;
    // As many cells in every line.
    std::vector<std::ptrdiff_t> cells;
    for (std::size_t at = 0; at < csv.size(); at = csv.find('\n', at) + 1) {
        std::string line = csv.substr(at, csv.find('\n', at) - at);
        const std::size_t open = line.find('"');
        if (open != std::string::npos) line.erase(open, line.rfind('"') - open);
        cells.push_back(std::ranges::count(line, ','));
    }
    EXPECT_EQ(std::ranges::count(cells, cells.front()), static_cast<std::ptrdiff_t>(cells.size()));
    EXPECT_NE(format_tables(tables, TableFormat::text).find("std 2D CAR"), std::string::npos);
}

TEST_F(BtfExperiment, TheReportHasMapsAndPicturesWhereverTheFolderIs) {
    const fs::path home = folder_ / "home";
    fs::create_directories(home);
    fs::rename(folder_ / "bumps", home / "bumps");
    fs::rename(folder_ / "e.json", home / "e.json");
    ExperimentRunOptions options = threads(1);
    options.textures = home / "best";
    run_experiment(read_experiment(home / "e.json"), home / "r.db", options);
    fs::rename(home, folder_ / "away");
    write_experiment_report(folder_ / "away/r.db", folder_ / "away/r.html");
    const std::string page = test::bytes_of((folder_ / "away/r.html").string());
    const auto count = [&](const std::string& part) {
        std::size_t found = 0;
        for (std::size_t at = page.find(part); at != std::string::npos; at = page.find(part, at + 1)) ++found;
        return found;
    };
    EXPECT_EQ(count("m by view and light"), 1U);
    EXPECT_EQ(count("class=\"disc\""), 6U) << "MEMD*, standard deviation and κ, of views and lights";
    EXPECT_EQ(count("data:image/png"), 12U) << "six pictures and six textures";
    EXPECT_EQ(count("not at hand"), 0U);
    EXPECT_EQ(count("not kept"), 0U);
}

TEST_F(BtfExperiment, ADirectionIsForgottenByItsName) {
    const fs::path database = folder_ / "r.db";
    run_experiment(config_, database, threads(1));
    OpenSets sets;
    const std::string name = picture_sources(config_, sets).at(1).name;
    ExperimentForget which;
    which.pictures = {name};
    EXPECT_EQ(forget_jobs(database, which).jobs, 2U);
    EXPECT_EQ(run_experiment(config_, database, threads(1)).done, 2U);
    // Another configuration leaves nothing of the first when that is stale.
    const ExperimentConfig other = config(R"("directions": [{"view": [0, 0], "light": [30, 120]}])");
    run_experiment(other, database, threads(1));
    which = {};
    which.stale = true;
    static_cast<void>(forget_jobs(database, which));
    EXPECT_EQ(query_lines(database, "SELECT name, view_theta, round(light_phi) FROM directions", 3),
              std::vector<std::string>{"bumps view 0,0 light 30,120|0.0|120.0|"});
}

TEST_F(BtfExperiment, ModelsOfTheSetAreOneOfTheModels) {
    fit_model(folder_ / "bumps.btfm");
    const std::string entry = R"("directions": {"number": 6, "seed": 3}, "btf_model": "bumps.btfm")";
    const ExperimentConfig joint = config(entry, "bumps", R"("btf", "2d-car")");
    const fs::path database = folder_ / "r.db";
    EXPECT_EQ(run_experiment(config_, database, threads(1)).done, 12U);
    ExperimentResult result = run_experiment(joint, database, threads(2));
    EXPECT_EQ(result.done, 6U) << result.failure;
    EXPECT_EQ(result.skipped, 12U) << "keys of the others do not change";
    EXPECT_EQ(run_experiment(joint, database, threads(1)).skipped, 18U);

    OpenSets sets;
    const PictureSource source = picture_sources(joint, sets).at(3);
    const BtfSynthesiser grown(device_, read_btf_model(folder_ / "bumps.btfm"), side, 5);
    const Image texture = grown.picture(source.direction->at.view, source.direction->at.light),
                picture = read_direction(sets, source.file, *source.direction, {});
    {
        Connection connection(database, Connection::Access::read, "read");
        Statement row(connection,
                      "SELECT memd, \"order\", levels, marginals, certified, parameters FROM results "
                      "WHERE name = ? AND model = 'btf'");
        row.bind(source.name);
        ASSERT_TRUE(row.step());
        EXPECT_NEAR(row.real(0), memd(device_, picture, texture).memd, 0.02);
        EXPECT_EQ(row.number(1), 0);
        EXPECT_EQ(row.number(2), 0);
        EXPECT_EQ(row.text(3), "any");
        EXPECT_EQ(row.number(4), 1);
        EXPECT_GT(row.number(5), 49 * 3);
    }
    // Another model of that name asks for its own jobs, and for no others.
    fit_model(folder_ / "bumps.btfm", 3);
    result = run_experiment(joint, database, threads(1));
    EXPECT_EQ(result.done, 6U);
    EXPECT_EQ(result.skipped, 12U);
    EXPECT_EQ(experiment_tables(database).at(0).rows.back().all.pictures, 6);
}

TEST(SampledPairs, AreSpreadAndNested) {
    class Gaps final : public BtfSource {
      public:
        Gaps() {
            description_.format = "gaps";
            description_.size = {4, 4};
            description_.planes = 1;
            description_.space = ColourSpace::unspecified;
            description_.views = description_.lights = btf_directions_81();
            description_.present.assign(81 * 81, 1);
            for (std::size_t i = 0; i < description_.present.size(); ++i)
                if ((i / 81 + i % 81) % 3 == 0) description_.present[i] = 0;
        }
        [[nodiscard]] const BtfDescription& description() const override { return description_; }
        [[nodiscard]] Image picture(int, int) const override { return Image({4, 4}, 1); }

      private:
        BtfDescription description_;
    };
    const BtfSet set{std::make_shared<Gaps>()};
    const std::vector<BtfPair> few = sampled_pairs(set, 30, 0), more = sampled_pairs(set, 162, 0);
    ASSERT_EQ(few.size(), 30U);
    ASSERT_EQ(more.size(), 162U);
    for (const BtfPair& pair : few) EXPECT_NE(std::ranges::find(more, pair), more.end());
    EXPECT_NE(few, sampled_pairs(set, 30, 1));
    std::vector<int> views(81, 0), lights(81, 0);
    for (std::size_t i = 0; i < more.size(); ++i) {
        EXPECT_TRUE(set.has(more[i].view, more[i].light));
        EXPECT_EQ(std::ranges::count(more, more[i]), 1);
        ++views[static_cast<std::size_t>(more[i].view)];
        ++lights[static_cast<std::size_t>(more[i].light)];
    }
    // Two of each would be even; chance alone would leave eleven views out.
    EXPECT_LE(std::ranges::count(views, 0), 1);
    EXPECT_LE(*std::ranges::max_element(views), 4);
    EXPECT_LE(std::ranges::count(lights, 0), 6);
    EXPECT_LE(*std::ranges::max_element(lights), 5);
    EXPECT_EQ(sampled_pairs(set, 81 * 81, 0), set.pictures());
}

}  // namespace
}  // namespace btfield
