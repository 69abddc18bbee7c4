// `btfield experiment` as a process of its own: killed, interrupted, on a full disk, beside another, under
// mpirun.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "tests/experiment_cases.hpp"
#include "tests/json_text.hpp"
#include "tests/mpi_cases.hpp"
#include "tests/places.hpp"
#include "tests/run_program.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::comparable_rows;
using test::Ended;
using test::run_program;
using test::Running;
using test::small_experiment;
using test::Surroundings;
using test::TemporaryFolder;
using test::whole_rows;
using Words = std::vector<std::string>;

constexpr int small_jobs = 24;

Words experiment(Words words) {
    words.insert(words.begin(), {test::command_path(), "experiment"});
    return words;
}

std::size_t rows_so_far(const fs::path& database) {
    try {
        return test::query_lines(database, "SELECT key FROM jobs", 1).size();
    } catch (const std::exception&) {
        return 0;  // not made yet
    }
}

TEST(CliExperiment, RunTableMergeReport) {
    const TemporaryFolder folder;
    const std::string config = small_experiment(folder).string(), database = (folder / "r.db").string();
    const Ended run = run_program(experiment({"run", config, "--out", database, "--json"}));
    ASSERT_EQ(run.code, 0) << run.err;
    const json object = test::parsed(run.out);
    EXPECT_EQ(object["jobs"], small_jobs);
    EXPECT_EQ(object["done"], small_jobs);
    EXPECT_EQ(object["failed"], 0);
    EXPECT_EQ(object["skipped"], 0);
    EXPECT_GT(object["seconds"]["total"].get<double>(), 0.0);

    for (const char* format : {"text", "md", "csv", "latex"}) {
        const Ended table = run_program(experiment({"table", database, "--format", format}));
        EXPECT_EQ(table.code, 0) << table.err;
        EXPECT_NE(table.out.find(format == std::string("csv") ? "3d-car" : "3D CAR"), std::string::npos)
            << table.out;
    }
    const json tables = test::parsed(run_program(experiment({"table", database, "--json"})).out);
    EXPECT_EQ(tables["tables"].size(), 1U);
    EXPECT_EQ(tables["tables"][0]["models"].size(), 2U);

    const std::string merged = (folder / "m.db").string();
    const json merge =
        test::parsed(run_program(experiment({"merge", database, "--out", merged, "--json"})).out);
    EXPECT_EQ(merge["jobs"], small_jobs);
    const std::string page = (folder / "p.html").string();
    EXPECT_EQ(run_program(experiment({"report", merged, "--out", page})).code, 0);
    EXPECT_TRUE(fs::exists(page));

    const std::string results = test::bytes_of(database);
    const Ended over = run_program(experiment({"report", database, "--out", database}));
    EXPECT_EQ(over.code, 1);
    EXPECT_NE(over.err.find("that is the database"), std::string::npos) << over.err;
    EXPECT_EQ(test::bytes_of(database), results);
}

/// A crop that is mistyped, corrected, and what was left behind: nothing that anybody has to take care of.
TEST(CliExperiment, ConfigurationThatChanges) {
    const TemporaryFolder folder;
    const fs::path config = small_experiment(folder);
    const std::string database = (folder / "r.db").string();
    const std::string text = test::bytes_of(config);
    const auto with_crop = [&](const std::string& crop) {
        std::string changed = text;
        changed.replace(changed.find("\"files\": [\"a.ppm\"]"), 18,
                        "\"files\": [\"a.ppm\"], \"crop\": " + crop);
        test::put_bytes(config, changed);
    };
    with_crop("[16, 16, 64, 64]");
    const Ended wrong = run_program(experiment({"run", config.string(), "--out", database}));
    EXPECT_EQ(wrong.code, 1);
    EXPECT_EQ(std::count(wrong.err.begin(), wrong.err.end(), '\n'), 1) << wrong.err;
    EXPECT_NE(wrong.err.find("'a.ppm' of stone, crop [16,16,64,64]"), std::string::npos) << wrong.err;
    EXPECT_FALSE(fs::exists(database));

    with_crop("[0, 0, 32, 24]");
    ASSERT_EQ(run_program(experiment({"run", config.string(), "--out", database})).code, 0);
    with_crop("[0, 0, 32, 32]");
    ASSERT_EQ(run_program(experiment({"run", config.string(), "--out", database})).code, 0);
    const Ended table = run_program(experiment({"table", database, "--json"}));
    EXPECT_NE(table.err.find("12 of the 36 jobs"), std::string::npos) << table.err;
    const json object = test::parsed(table.out);
    ASSERT_EQ(object["tables"].size(), 1U);
    EXPECT_EQ(object["jobs"], 36);
    EXPECT_EQ(object["tables"][0]["done"], 24);
    EXPECT_EQ(object["tables"][0]["configuration"], "small");
    EXPECT_EQ(object["tables"][0]["noise"], "full");
    EXPECT_EQ(object["tables"][0]["models"][0]["all"]["pictures"], 2);
    EXPECT_EQ(object["tables"][0]["models"][0]["all"]["of"], 2);
    ASSERT_EQ(object["configurations"].size(), 2U);
    EXPECT_EQ(object["configurations"][0]["jobs"], 24);
    const json all =
        test::parsed(run_program(experiment({"table", database, "--json", "--all-configurations"})).out);
    EXPECT_EQ(all["tables"].size(), 2U);

    const Ended listed = run_program(experiment({"forget", database, "--stale", "--dry-run"}));
    EXPECT_EQ(listed.code, 0) << listed.err;
    EXPECT_NE(listed.out.find("would forget 12 jobs: 12 done, 0 refused, 0 failed; 24 jobs would be left"),
              std::string::npos)
        << listed.out;
    const json forgotten =
        test::parsed(run_program(experiment({"forget", database, "--stale", "--json"})).out);
    EXPECT_EQ(forgotten["jobs"], 12);
    EXPECT_EQ(forgotten["left"], 24);
    EXPECT_EQ(forgotten["dry_run"], false);
    EXPECT_EQ(forgotten["forgotten"].size(), 2U);
    EXPECT_EQ(run_program(experiment({"table", database})).err, "");
    const json seeds = test::parsed(
        run_program(experiment({"forget", database, "--seed", "5", "--model", "2d-car,3d-car", "--json"}))
            .out);
    EXPECT_EQ(seeds["jobs"], 12);
}

TEST(CliExperiment, CompoundAndRollInTables) {
    const TemporaryFolder folder;
    const std::string config = test::varied_experiment(folder).string(),
                      database = (folder / "r.db").string();
    const Ended run = run_program(experiment({"run", config, "--out", database, "--json"}));
    ASSERT_EQ(run.code, 0) << run.err;
    EXPECT_EQ(test::parsed(run.out)["done"], 10);
    const json table = test::parsed(run_program(experiment({"table", database, "--json"})).out)["tables"][0];
    std::vector<std::string> models;
    for (const json& row : table["models"]) {
        models.push_back(row["model"].get<std::string>());
        EXPECT_GT(row["all"]["mean"].get<double>(), 0.0) << row["model"];
    }
    EXPECT_EQ(models, (std::vector<std::string>{"3d-car", "compound", "roll"}));
    EXPECT_TRUE(table["materials"][0]["best_2d"].is_null());
}

TEST(CliExperiment, PicturesOfABtf) {
    const TemporaryFolder folder;
    fs::create_directories(folder / "set");
    unsigned seed = 51;
    for (const char* name : {"tl000_pl000_tv000_pv000", "tl030_pl090_tv000_pv000", "tl030_pl090_tv045_pv180"})
        test::write_texture(folder / "set" / (std::string(name) + ".ppm"), seed++);
    test::put_bytes(folder / "e.json", R"({"pictures": [{"material": "m", "btf": "set", "directions": "all"}],
        "models": ["2d-car"], "orders": [1], "levels": [1]})");
    const std::string config = (folder / "e.json").string(), database = (folder / "r.db").string();
    const Ended run = run_program(experiment({"run", config, "--out", database}));
    ASSERT_EQ(run.code, 0) << run.err;
    const Ended ended = run_program(experiment({"table", database, "--by", "picture", "--json"}));
    ASSERT_EQ(ended.code, 0) << ended.err;
    const json rows = test::parsed(ended.out)["tables"][0]["pictures"];
    ASSERT_EQ(rows.size(), 3U);
    EXPECT_EQ(rows[1]["picture"], "set view 0,0 light 30,90");
    EXPECT_EQ(rows[2]["view"], json::array({45, 180}));
    EXPECT_EQ(rows[2]["light"], json::array({30, 90}));
    EXPECT_GT(rows[2]["std_ratio"]["2d-car"], 0.5);
    fs::remove(folder / "set/tl030_pl090_tv000_pv000.ppm");
    test::put_bytes(folder / "e.json", R"({"pictures": [{"material": "m", "btf": "set",
        "directions": [{"view": [0, 0], "light": [30, 90]}]}],
        "models": ["2d-car"], "orders": [1], "levels": [1]})");
    const Ended missing = run_program(experiment({"run", config, "--out", (folder / "n.db").string()}));
    EXPECT_EQ(missing.code, 1);
    EXPECT_EQ(std::count(missing.err.begin(), missing.err.end(), '\n'), 1) << missing.err;
    EXPECT_NE(missing.err.find("it has no picture of view 0,0 light 30,90"), std::string::npos)
        << missing.err;
    EXPECT_FALSE(fs::exists(folder / "n.db"));
}

TEST(CliExperiment, WrongUsage) {
    const TemporaryFolder folder;
    const std::string config = small_experiment(folder).string(), database = (folder / "r.db").string();
    const std::vector<Words> wrong{{},
                                   {"run"},
                                   {"run", config},
                                   {"run", config, "--out", database, "--shard", "0/2"},
                                   {"run", config, "--out", database, "--shard", "3/2"},
                                   {"run", config, "--out", database, "--shard", "1"},
                                   {"run", config, "--out", database, "--jobs", "0"},
                                   {"table", database, "--format", "xml"},
                                   {"table", database, "--by", "noise,colour"},
                                   {"table", database, "--configuration", "a", "--all-configurations"},
                                   {"forget", database},
                                   {"forget", database, "--model", "4d-car"},
                                   {"forget", database, "--order", "1,x"},
                                   {"merge", database}};
    for (const Words& words : wrong) {
        const Ended ended = run_program(experiment(words));
        EXPECT_EQ(ended.code, 2) << ended.err;
        EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
        const std::string command = words.empty() ? "experiment" : "experiment " + words.front();
        EXPECT_NE(ended.err.find("btfield: " + command + ": "), std::string::npos) << ended.err;
        EXPECT_NE(ended.err.find("'btfield " + command + " --help'"), std::string::npos) << ended.err;
    }
    for (const char* command : {"run", "merge", "report"}) {  // as their errors say
        const Ended help = run_program(experiment({command, "--help"}));
        EXPECT_NE(help.out.find("-o,--out"), std::string::npos) << help.out;
    }
    test::put_bytes(folder / "bad.json", R"({"picture": []})");
    const Ended bad = run_program(experiment({"run", (folder / "bad.json").string(), "--out", database}));
    EXPECT_EQ(bad.code, 1);
    EXPECT_NE(bad.err.find("unknown key 'picture'"), std::string::npos) << bad.err;
    EXPECT_FALSE(fs::exists(database));
}

TEST(CliExperiment, NoDatabaseWithoutAResult) {
    const TemporaryFolder folder;
    const std::string config = small_experiment(folder).string(), database = (folder / "r.db").string(),
                      absent = (folder / "absent-picture.json").string(), file = (folder / "file").string();
    test::put_bytes(absent, R"({"pictures": [{"material": "x", "files": ["none.png"]}], "models": ["2d-car"],
                               "orders": [1], "levels": [1], "seeds": [1]})");
    test::put_bytes(file, "");
    for (const auto& [words, code, part] : std::vector<std::tuple<Words, int, std::string>>{
             {{"run", absent, "--out", database}, 1, "none.png"},
             {{"run", config, "--out", database, "--device", "no such device"}, 3, "no such device"},
             {{"run", config, "--out", database, "--synth-out", file}, 1, "that is no folder"},
             {{"run", config, "--out", ""}, 2, "--out: the value is empty"}}) {
        const std::vector<std::string> before = folder.names();
        const Ended ended = run_program(experiment(words));
        EXPECT_EQ(ended.code, code) << ended.err;
        EXPECT_NE(ended.err.find(part), std::string::npos) << ended.err;
        EXPECT_EQ(folder.names(), before);
    }
}

TEST(CliExperiment, ProgressOnATerminal) {
    const TemporaryFolder folder;
    const std::string config = small_experiment(folder).string(), database = (folder / "r.db").string();
    Surroundings around;
    around.terminal = true;
    const Ended run = run_program(experiment({"run", config, "--out", database}), around);
    EXPECT_EQ(run.code, 0) << run.err;
    EXPECT_NE(run.err.find('['), std::string::npos) << run.err;
    EXPECT_NE(run.err.find("/24"), std::string::npos) << run.err;
}

TEST(CliExperiment, FullDisk) {
    const TemporaryFolder folder;
    const std::string config = small_experiment(folder).string(), database = (folder / "r.db").string();
    Surroundings around;
    around.file_limit = rlim_t{80} << 10;
    const Ended full = run_program(experiment({"run", config, "--out", database}), around);
    EXPECT_EQ(full.code, 1);
    EXPECT_EQ(std::count(full.err.begin(), full.err.end(), '\n'), 1) << full.err;
    EXPECT_NE(full.err.find("free some space"), std::string::npos) << full.err;
    EXPECT_EQ(run_program(experiment({"run", config, "--out", database})).code, 0);
    EXPECT_EQ(rows_so_far(database), static_cast<std::size_t>(small_jobs));
}

TEST(CliExperiment, CtrlCFinishesAndSaysHowToResume) {
    const TemporaryFolder folder;
    const std::string config = small_experiment(folder).string(), database = (folder / "r.db").string();
    Running run(experiment({"run", config, "--out", database, "--jobs", "1"}), folder.path());
    while (rows_so_far(database) == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    run.kill(SIGINT);
    const int code = run.wait();
    const std::string err = run.err();
    const auto rows = rows_so_far(database);
    if (rows < static_cast<std::size_t>(small_jobs)) {  // else the signal came too late
        EXPECT_EQ(code, 1) << err;
        EXPECT_NE(err.find("run the same command again"), std::string::npos) << err;
        EXPECT_NE(err.find(std::to_string(rows) + " of 24 jobs"), std::string::npos) << err;
    }
    EXPECT_EQ(run_program(experiment({"run", config, "--out", database})).code, 0);
    EXPECT_EQ(rows_so_far(database), static_cast<std::size_t>(small_jobs));
}

/// Runs, is killed after a random time, and runs again, fifty times; then to the end.
TEST(CliExperimentLong, FiftyKills) {
    const TemporaryFolder folder;
    const std::string config = small_experiment(folder).string(), database = (folder / "r.db").string();
    const std::string whole = (folder / "whole.db").string(), best = (folder / "best").string();
    const auto start = std::chrono::steady_clock::now();
    ASSERT_EQ(
        run_program(experiment({"run", config, "--out", whole, "--synth-out", best, "--jobs", "2"})).code, 0);
    const double once = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

    std::mt19937 random(20);
    std::uniform_real_distribution<double> moment(0.0, 1.1 * once);
    std::map<std::string, std::string> rows;  // by key
    int killed = 0;
    std::set<std::size_t> states;
    while (killed < 50) {
        Running run(experiment({"run", config, "--out", database, "--synth-out", best, "--jobs", "2"}),
                    folder.path());
        std::this_thread::sleep_for(std::chrono::duration<double>(moment(random)));
        run.kill(SIGKILL);
        const int code = run.wait();
        ASSERT_TRUE(code == 128 + SIGKILL || code == 0) << run.err();
        killed += code == 0 ? 0 : 1;
        if (!fs::exists(database)) continue;
        // What was there is there as it was, times included: no job was lost and none was done again.
        std::map<std::string, std::string> now;
        if (rows_so_far(database) > 0) {
            for (const std::string& row : whole_rows(database)) now.emplace(row.substr(0, 64), row);
        }
        for (const auto& [key, row] : rows) EXPECT_EQ(now[key], row);
        rows = now;
        states.insert(rows.size());
        if (rows.size() == static_cast<std::size_t>(small_jobs)) {  // complete: begin anew
            EXPECT_EQ(comparable_rows(database), comparable_rows(whole));
            for (const char* suffix : {"", "-wal", "-shm", "-lock"}) fs::remove(database + suffix);
            rows.clear();
        }
    }
    EXPECT_EQ(run_program(experiment({"run", config, "--out", database, "--jobs", "2"})).code, 0);
    EXPECT_EQ(comparable_rows(database), comparable_rows(whole));
    EXPECT_GE(states.size(), 4U) << "the kills came all at the same place";
}

/// The committed experiment: all ten models.
TEST(CliExperimentLong, CommittedExperiment) {
    const TemporaryFolder folder;
    const std::string config = test::data_folder() + "/experiment.json",
                      database = (folder / "r.db").string();
    const Ended run = run_program(
        experiment({"run", config, "--out", database, "--synth-out", (folder / "best").string(), "--json"}));
    ASSERT_EQ(run.code, 0) << run.err;
    const json object = test::parsed(run.out);
    EXPECT_EQ(object["failed"], 0);
    const json table = test::parsed(run_program(experiment({"table", database, "--json"})).out)["tables"][0];
    EXPECT_EQ(table["models"].size(), 10U);
    for (const json& row : table["models"]) {
        for (const json& cell : row["materials"]) {
            // Whatever the model, its colours are those of a field with the picture's mean and variance: P4's
            // worst material and model, 2D MA on silver-gold, has 23 %.
            EXPECT_GT(cell["pictures"].get<int>(), 0) << row["model"];
            EXPECT_LT(cell["mean"].get<double>(), 23.0) << row["model"];
        }
    }
    EXPECT_EQ(run_program(experiment({"report", database, "--out", (folder / "p.html").string()})).code, 0);
}

#ifdef BTFIELD_MPI
TEST(CliExperiment, TwoRanks) {
    const TemporaryFolder folder;
    const std::string config = small_experiment(folder).string();
    const std::string one = (folder / "1.db").string(), two = (folder / "2.db").string();
    ASSERT_EQ(run_program(experiment({"run", config, "--out", one})).code, 0);
    const Ended run = run_program(test::ranks(2, experiment({"run", config, "--out", two, "--json"})));
    ASSERT_EQ(run.code, 0) << run.err;
    EXPECT_EQ(test::parsed(run.out)["done"], small_jobs) << run.out;  // one object: rank 0's
    EXPECT_EQ(comparable_rows(two), comparable_rows(one));
    const Ended again = run_program(test::ranks(2, experiment({"run", config, "--out", two, "--json"})));
    EXPECT_EQ(test::parsed(again.out)["skipped"], small_jobs);

    const Ended wrong =
        run_program(test::ranks(2, experiment({"run", (folder / "absent.json").string(), "--out", two})));
    EXPECT_EQ(wrong.code, 1) << wrong.err;
    EXPECT_NE(wrong.err.find("absent.json"), std::string::npos) << wrong.err;
}
#endif

}  // namespace
}  // namespace btfield
