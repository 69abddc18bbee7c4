#include "btfield/experiment.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/base/text_table.hpp"
#include "host/cli/command.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/ending.hpp"
#include "host/cli/mpi_ranks.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"
#include "host/cli/run_files.hpp"
#include "host/criteria/metric_names.hpp"
#include "host/experiment/experiment_names.hpp"
#include "host/fit/fit_names.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

struct RunOptions {
    std::string config, database, device, textures;
    std::optional<int> jobs;
    ExperimentRunOptions run;
    bool json = false;
};

std::string clock_text(double seconds) {
    const auto whole = static_cast<long long>(std::ceil(seconds));
    const long long hours = whole / 3600, minutes = whole / 60 % 60;
    char text[32];
    if (hours > 0) {
        std::snprintf(text, sizeof text, "%lld:%02lld:%02lld", hours, minutes, whole % 60);
    } else {
        std::snprintf(text, sizeof text, "%lld:%02lld", minutes, whole % 60);
    }
    return text;
}

/// A bar on a terminal; else a line now and then.
class RunProgress {
  public:
    void show(const ExperimentProgress& progress) {
        const std::uint64_t finished = progress.done + progress.refused + progress.failed;
        const std::uint64_t left = progress.jobs - progress.skipped - finished;
        std::string text = std::string(progress.stage);
        if (finished > 0) {
            const double rate = static_cast<double>(finished) / progress.seconds;
            text = number_text(rate) + " jobs/s, " + clock_text(static_cast<double>(left) / rate) + " left";
            if (left == 0) text = std::string(progress.stage);
        }
        if (terminal_) {
            const double share = progress.jobs == 0 ? 0.0
                                                    : static_cast<double>(progress.skipped + finished) /
                                                          static_cast<double>(progress.jobs);
            bar_.show(share, std::to_string(progress.skipped + finished) + "/" +
                                 std::to_string(progress.jobs) + ", " + text);
            return;
        }
        if (progress.seconds - last_line_ < line_interval) return;
        last_line_ = progress.seconds;
        const std::string line = std::to_string(progress.skipped + finished) + " of " +
                                 detail::counted(progress.jobs, "job") + ": " + text + "\n";
        std::fputs(line.c_str(), stderr);
    }

  private:
    static constexpr double line_interval = 10.0;  // seconds
    bool terminal_ = ::isatty(STDERR_FILENO) == 1;
    double last_line_ = 0.0;
    Progress bar_;
};

Json result_json(const ExperimentResult& result) {
    Json seconds;
    seconds["total"] = result.seconds;
    Json object;
    object["jobs"] = result.jobs;
    object["done"] = result.done;
    object["refused"] = result.refused;
    object["failed"] = result.failed;
    object["skipped"] = result.skipped;
    object["interrupted"] = result.interrupted;
    object["seconds"] = std::move(seconds);
    return object;
}

std::string result_text(const ExperimentResult& result) {
    const std::uint64_t worked = result.done + result.refused + result.failed;
    std::string text = detail::counted(result.jobs, "job") + ": " + std::to_string(result.done) + " done, " +
                       std::to_string(result.refused) + " refused, " + std::to_string(result.failed) +
                       " failed, " + std::to_string(result.skipped) + " skipped; " +
                       seconds_text(result.seconds);
    if (worked > 0 && result.seconds > 0.0) {
        text += ", " + number_text(static_cast<double>(worked) / result.seconds) + " jobs/s";
    }
    if (result.refused > 0) text += "; 'btfield experiment table' says why jobs were refused";
    return text + "\n";
}

void read_shard(const std::string& text, ExperimentRunOptions& options) {
    const std::size_t slash = text.find('/');
    constexpr std::uint64_t most = 1'000'000;
    const auto count =
        slash == std::string::npos ? std::nullopt : parse_number(text.substr(slash + 1), 1, most);
    const auto index = count ? parse_number(text.substr(0, slash), 1, *count) : std::nullopt;
    if (!index)
        throw CLI::ValidationError("--shard", "'" + text + "' is not I/N with I from 1 to N, such as 2/8");
    options.shard = static_cast<int>(*index);
    options.shards = static_cast<int>(*count);
}

/// What a shell would need to run the same again.
std::string resume_text(const RunOptions& options) {
    return "run the same command again: it resumes from '" + options.database + "'";
}

void run(const RunOptions& options) {
    const std::unique_ptr<ExperimentRanks> ranks = open_ranks();
    std::atomic<bool> interrupted{false};
    // SIGUSR1 is what mpirun passes on to its ranks, and what batch systems send before the time is over.
    const Interruption interruption([&] { interrupted = true; });
    ExperimentRunOptions run_options = options.run;
    run_options.device = options.device;
    run_options.jobs = options.jobs.value_or(0);
    run_options.textures = options.textures;
    run_options.ranks = ranks.get();
    run_options.stop = [&] { return interrupted.load(); };
    if (ranks && ranks->rank() > 0) {
        run_experiment({}, options.database, run_options);
        return;
    }

    ExperimentConfig config;
    try {
        config = read_experiment(options.config);
    } catch (...) {
        if (ranks) dismiss(*ranks);
        throw;
    }
    ExperimentResult result;
    {
        RunProgress progress;
        run_options.progress = [&](const ExperimentProgress& now) { progress.show(now); };
        result = run_experiment(config, options.database, run_options);
    }
    if (options.json) {
        emit_json(result_json(result));
    } else {
        emit_text(result_text(result));
    }
    const std::string asked = "run the experiment '" + options.config + "'";
    const std::uint64_t finished = result.skipped + result.done + result.refused;
    if (result.interrupted) {
        throw InputError(asked,
                         "it was interrupted after " + std::to_string(finished) + " of " +
                             detail::counted(result.jobs, "job"),
                         resume_text(options));
    }
    if (result.failed > 0) {
        throw InputError(asked,
                         detail::counted(result.failed, "job") + " failed, the first: " + result.failure,
                         "mend that and " + resume_text(options));
    }
}

void add_run(CLI::App& parent, Action& action) {
    CLI::App* command =
        parent.add_subcommand("run", "fit, synthesise and measure all that a configuration lists");
    const auto options = std::make_shared<RunOptions>();
    command->add_option("CONFIG", options->config, "configuration, JSON: see docs/experiments.md")
        ->required()
        ->type_name("");
    command->add_option("-o,--out", options->database, "database of results; one that exists is completed")
        ->required()
        ->type_name("RESULTS.db");
    command
        ->add_option_function<std::string>(
            "--shard", [options](const std::string& text) { read_shard(text, options->run); },
            "only part I of N, into a database of its own; `experiment merge` joins them")
        ->type_name("I/N");
    add_int(*command, "--jobs", options->jobs, 1, 1024,
            "threads that work side by side (default: one per core; one per rank under mpirun)");
    command
        ->add_option("--synth-out", options->textures,
                     "folder that gets the best texture of each picture and model")
        ->type_name("DIR");
    add_device(*command, options->device);
    add_json(*command, options->json);
    set_guide(
        *command,
        {.usual = {{"btfield experiment run sand.json --out sand.db"}},
         .more = {{"btfield experiment run sand.json --out sand-2.db --shard 2/8"},
                  {"mpirun -n 16 btfield experiment run sand.json --out sand.db --synth-out best/"}},
         .notes = {"Ctrl-C ends the run after the fits under way; the same command resumes it, as after any "
                   "other end."}});
    command->callback([options, &action] { action = [options] { run(*options); }; });
}

struct TableOptions {
    std::string database;
    ExperimentTableOptions tables;
    TableFormat format = TableFormat::text;
    bool json = false;
};

/// Parts of a list, "a,b".
std::vector<std::string> parts_of(const std::string& text) {
    std::vector<std::string> parts{""};
    for (const char c : text) {
        if (c == ',') {
            parts.emplace_back();
        } else {
            parts.back() += c;
        }
    }
    return parts;
}

void add_table_options(CLI::App& command, ExperimentTableOptions& options) {
    const auto read = [&options](const std::string& text) {
        for (const std::string& part : parts_of(text)) {
            if (part != "noise" && part != "gains" && part != "estimator" && part != "picture")
                throw CLI::ValidationError("--by",
                                           "'" + part + "' is none of noise, gains, estimator, picture");
            (part == "noise"       ? options.by_noise
             : part == "gains"     ? options.by_gains
             : part == "estimator" ? options.by_estimator
                                   : options.by_picture) = true;
        }
    };
    command
        .add_option_function<std::string>(
            "--by", read,
            "tables apart by noise, gains, estimator, or several of them; picture: a row for "
            "each picture too")
        ->type_name("WHAT,…");
    CLI::Option* name =
        command
            .add_option("--configuration", options.configuration,
                        "whose pictures and settings count, by its name (default: the one that was run last)")
            ->type_name("NAME");
    command
        .add_flag("--all-configurations", options.all_configurations,
                  "tables of every configuration that was run into the database, each by itself")
        ->excludes(name);
}

/// What does not count, so that nobody takes tables for those of the whole database.
void warn_of_others(const std::string& database, const ExperimentTableOptions& options,
                    const ExperimentContents& contents) {
    if (options.all_configurations || contents.configurations.empty()) return;
    const auto shown = options.configuration.empty()
                           ? contents.configurations.begin()
                           : std::ranges::find(contents.configurations, options.configuration,
                                               &ExperimentContents::Configuration::name);
    if (shown == contents.configurations.end() || shown->jobs == contents.jobs) return;
    const std::uint64_t others = contents.jobs - shown->jobs;
    warn(std::to_string(others) + " of the " + detail::counted(contents.jobs, "job") + " in '" + database +
         (others == 1 ? "' is" : "' are") + " of pictures or settings that '" + shown->name +
         "' does not have, and " + (others == 1 ? "does" : "do") +
         " not count; see --all-configurations, and 'experiment forget --stale'");
}

Json contents_json(const ExperimentContents& contents) {
    Json list = Json::array();
    for (const ExperimentContents::Configuration& configuration : contents.configurations) {
        Json entry;
        entry["name"] = configuration.name;
        entry["last_run"] = configuration.last_run;
        entry["jobs"] = configuration.jobs;
        list.push_back(std::move(entry));
    }
    return list;
}

/// \param of pictures of the column
Json cell_json(const ExperimentTable::Cell& cell, int of) {
    Json object;
    object["mean"] = number(cell.mean);
    object["std"] = number(cell.deviation);
    object["pictures"] = cell.pictures;
    object["of"] = of;
    return object;
}

Json table_json(const ExperimentTable& table) {
    Json models = Json::array();
    for (const ExperimentTable::Row& row : table.rows) {
        Json entry;
        entry["model"] = row.model;
        entry["materials"] = Json::array();
        for (std::size_t m = 0; m < row.materials.size(); ++m)
            entry["materials"].push_back(cell_json(row.materials[m], table.pictures[m]));
        entry["all"] = cell_json(row.all, table.all_pictures);
        models.push_back(std::move(entry));
    }
    Json materials = Json::array();
    for (std::size_t m = 0; m < table.materials.size(); ++m) {
        const ExperimentTable::Colour& colour = table.colours[m];
        Json entry;
        entry["material"] = table.materials[m];
        entry["pictures"] = table.pictures[m];
        entry["kappa"] = number(colour.kappa);
        entry["verdict"] = colour.needs_3d ? "3d" : "2d";
        entry["best_2d"] = number(colour.best_2d);
        entry["best_3d"] = number(colour.best_3d);
        entry["gap"] = colour.gap;
        materials.push_back(std::move(entry));
    }
    Json object;
    object["configuration"] = table.configuration;
    object["metric"] = table.metric;
    object["marginals"] = table.marginals;
    object["noise"] = table.noise;
    object["gains"] = table.gains;
    object["estimator"] = table.estimators;
    object["materials"] = std::move(materials);
    object["models"] = std::move(models);
    object["done"] = table.done;
    object["refused"] = table.refused;
    object["failed"] = table.failed;
    object["reasons"] = Json::array();
    for (const ExperimentTable::Reason& reason : table.reasons) {
        Json entry;
        entry["status"] = reason.status;
        entry["reason"] = reason.text;
        entry["models"] = reason.models;
        entry["jobs"] = reason.jobs;
        object["reasons"].push_back(std::move(entry));
    }
    for (const ExperimentTable::PictureRow& row : table.picture_rows) {
        Json entry;
        entry["picture"] = row.picture;
        entry["material"] = row.material;
        entry["kappa"] = number(row.kappa);
        for (std::size_t m = 0; m < row.best.size(); ++m)
            entry["memd_star"][table.rows[m].model] = number(row.best[m]);
        object["pictures"].push_back(std::move(entry));
    }
    return object;
}

void run_table(const TableOptions& options) {
    const std::vector<ExperimentTable> tables = experiment_tables(options.database, options.tables);
    const ExperimentContents contents = experiment_contents(options.database);
    warn_of_others(options.database, options.tables, contents);
    if (!options.json) {
        emit_text(format_tables(tables, options.format));
        return;
    }
    Json object;
    object["tables"] = Json::array();
    for (const ExperimentTable& table : tables) object["tables"].push_back(table_json(table));
    object["configurations"] = contents_json(contents);
    object["jobs"] = contents.jobs;
    emit_json(object);
}

void add_table(CLI::App& parent, Action& action) {
    CLI::App* command =
        parent.add_subcommand("table", "best MEMD* of every model and material, as P4's Table 1");
    const auto options = std::make_shared<TableOptions>();
    command->add_option("RESULTS.db", options->database, "database of an experiment, finished or not")
        ->required()
        ->type_name("");
    add_choice(*command, "--format", options->format, "of the table (default: text)");
    add_table_options(*command, options->tables);
    add_json(*command, options->json);
    set_guide(*command,
              {.usual = {{"btfield experiment table sand.db"}},
               .more = {{"btfield experiment table sand.db --format latex"},
                        {"btfield experiment table sand.db --by noise,estimator"},
                        {"btfield experiment table sand.db --by picture"}},
               .notes = {"Jobs of pictures and settings that the configuration does not have do not "
                         "count. LaTeX needs the package booktabs."}});
    command->callback([options, &action] { action = [options] { run_table(*options); }; });
}

struct MergeOptions {
    std::vector<std::string> inputs;
    std::string output;
    bool json = false;
};

void add_merge(CLI::App& parent, Action& action) {
    CLI::App* command = parent.add_subcommand("merge", "join the databases of shards");
    const auto options = std::make_shared<MergeOptions>();
    command->add_option("RESULTS.db", options->inputs, "databases of experiments")->required()->type_name("");
    command->add_option("-o,--out", options->output, "new database")->required()->type_name("RESULTS.db");
    add_json(*command, options->json);
    set_guide(*command, {{{"btfield experiment merge sand-1.db sand-2.db --out sand.db"}}});
    command->callback([options, &action] {
        action = [options] {
            const ExperimentResult result =
                merge_experiments({options->inputs.begin(), options->inputs.end()}, options->output);
            if (options->json) {
                emit_json(result_json(result));
            } else {
                emit_result("wrote " + options->output + ": " + result_text(result));
            }
        };
    });
}

struct ReportOptions {
    std::string database, page;
    ExperimentTableOptions tables;
    int pictures = 24;
    bool overwrite = false, json = false;
};

void add_report(CLI::App& parent, Action& action) {
    CLI::App* command = parent.add_subcommand("report", "write one HTML page with table, pictures and plots");
    const auto options = std::make_shared<ReportOptions>();
    command->add_option("RESULTS.db", options->database, "database of an experiment, finished or not")
        ->required()
        ->type_name("");
    command->add_option("-o,--out", options->page, "page, which needs no other file")
        ->required()
        ->type_name("PAGE.html");
    add_int(*command, "--pictures", options->pictures, 0, 100000,
            "pictures that are shown one by one at most (default: 24)");
    add_table_options(*command, options->tables);
    add_overwrite(*command, options->overwrite);
    add_json(*command, options->json);
    set_guide(*command, {.usual = {{"btfield experiment report sand.db --out sand.html"}},
                         .notes = {"Textures are shown where 'experiment run --synth-out' has kept them."}});
    command->callback([options, &action] {
        action = [options] {
            RunFiles files(options->overwrite, options->json);
            files.reads(options->database, "that is the database");
            files.writes_text(options->page);
            write_experiment_report(options->database, options->page, options->pictures, options->tables);
            warn_of_others(options->database, options->tables, experiment_contents(options->database));
            if (options->json) {
                Json object;
                object["output"] = options->page;
                emit_json(object);
            } else {
                emit_result("wrote " + options->page + "\n");
            }
        };
    });
}

struct ForgetOptions {
    std::string database;
    ExperimentForget which;
    bool json = false;
};

Json forgotten_json(const ForgottenJobs& forgotten, bool dry_run) {
    Json parts = Json::array();
    for (const ForgottenJobs::Part& part : forgotten.parts) {
        Json entry;
        entry["picture"] = part.picture;
        entry["model"] = part.model;
        entry["done"] = part.done;
        entry["refused"] = part.refused;
        entry["failed"] = part.failed;
        parts.push_back(std::move(entry));
    }
    Json object;
    object["dry_run"] = dry_run;
    object["jobs"] = forgotten.jobs;
    object["done"] = forgotten.done;
    object["refused"] = forgotten.refused;
    object["failed"] = forgotten.failed;
    object["textures"] = forgotten.textures;
    object["left"] = forgotten.left;
    object["forgotten"] = std::move(parts);
    return object;
}

std::string forgotten_text(const ForgottenJobs& forgotten, bool dry_run) {
    std::string text;
    if (forgotten.jobs > 0) {
        std::vector<std::vector<std::string>> rows{{"picture", "model", "done", "refused", "failed"}};
        for (const ForgottenJobs::Part& part : forgotten.parts)
            rows.push_back({part.picture, part.model, std::to_string(part.done), std::to_string(part.refused),
                            std::to_string(part.failed)});
        text = detail::table(rows, "llrrr");
    }
    const auto jobs = [](std::uint64_t count) {
        return std::to_string(count) + (count == 1 ? " job" : " jobs");
    };
    text += (dry_run ? "would forget " : "forgot ") + jobs(forgotten.jobs) + ": " +
            std::to_string(forgotten.done) + " done, " + std::to_string(forgotten.refused) + " refused, " +
            std::to_string(forgotten.failed) + " failed; " + jobs(forgotten.left) +
            (dry_run ? " would be left\n" : " left\n");
    if (forgotten.textures > 0)
        text += std::to_string(forgotten.textures) +
                (forgotten.textures == 1 ? " kept texture is" : " kept textures are") +
                (dry_run ? " then" : "") + " no longer of a best job; files stay\n";
    return text;
}

/// "a,b" of an enumeration's words.
template <class Value>
void add_words(CLI::App& command, const std::string& name, std::vector<Value>& values,
               const std::string& help) {
    const auto read = [name, &values](const std::string& text) {
        for (const std::string& part : parts_of(text)) {
            const auto found = detail::find_value<Value>(part);
            if (!found)
                throw CLI::ValidationError(name, "'" + part + "' is none of " + detail::words_of<Value>());
            values.push_back(*found);
        }
    };
    command.add_option_function<std::string>(name, read, help + ": " + detail::words_of<Value>())
        ->type_name("WORD,…");
}

/// "1,2" of numbers.
template <class Value>
void add_numbers(CLI::App& command, const std::string& name, std::vector<Value>& values, std::uint64_t most,
                 const std::string& help) {
    const auto read = [name, &values, most](const std::string& text) {
        for (const std::string& part : parts_of(text)) {
            const auto found = parse_number(part, 0, most);
            if (!found)
                throw CLI::ValidationError(
                    name, "'" + part + "' is no whole number from 0 to " + std::to_string(most));
            values.push_back(static_cast<Value>(*found));
        }
    };
    command.add_option_function<std::string>(name, read, help)->type_name("N,…");
}

void add_conditions(CLI::App& command, ExperimentForget& which) {
    command
        .add_option("--picture", which.pictures, "of a picture, by name, pattern or hash; may be repeated")
        ->allow_extra_args(false)
        ->type_name("NAME");
    command.add_option("--material", which.materials, "of a material; may be repeated")
        ->allow_extra_args(false)
        ->type_name("NAME");
    add_words(command, "--model", which.models, "of these models");
    add_numbers(command, "--order", which.orders, 8, "of these orders");
    add_numbers(command, "--levels", which.levels, 30, "of these numbers of levels");
    add_words(command, "--estimator", which.estimators, "of these estimators");
    add_words(command, "--marginals", which.marginals, "of these marginals");
    add_words(command, "--noise", which.noise, "of these noise forms");
    add_words(command, "--gains", which.gains, "of these gains");
    add_words(command, "--metric", which.metrics, "of these metrics");
    add_numbers(command, "--seed", which.seeds, std::numeric_limits<std::int64_t>::max(), "of these seeds");
    command.add_flag("--failed", which.failed, "that failed");
    command.add_flag("--refused", which.refused, "that were refused");
    command.add_flag("--stale", which.stale,
                     "of pictures or settings that the configuration that was run last does not have");
    command.add_flag("-n,--dry-run", which.dry_run, "list what would be forgotten, and change nothing");
}

void run_forget(const ForgetOptions& options) {
    if (options.which.is_empty())
        throw UsageError("nothing says which jobs: give a picture, material, setting or state");
    const ForgottenJobs forgotten = forget_jobs(options.database, options.which);
    if (options.json) {
        emit_json(forgotten_json(forgotten, options.which.dry_run));
    } else {
        emit_text(forgotten_text(forgotten, options.which.dry_run));
    }
}

void add_forget(CLI::App& parent, Action& action) {
    CLI::App* command =
        parent.add_subcommand("forget", "remove jobs from a database, by picture, model, setting or state");
    const auto options = std::make_shared<ForgetOptions>();
    command->add_option("RESULTS.db", options->database, "database of an experiment")
        ->required()
        ->type_name("");
    add_conditions(*command, options->which);
    add_json(*command, options->json);
    set_guide(
        *command,
        {.usual = {{"btfield experiment forget sand.db --stale --dry-run"}},
         .more = {{"btfield experiment forget sand.db --failed"},
                  {"btfield experiment forget sand.db --picture 'beach*.png' --model 3d-ma,2d-ma"}},
         .notes = {"Jobs that meet every condition are forgotten. The next run does those anew that its "
                   "configuration asks for."}});
    command->callback([options, &action] { action = [options] { run_forget(*options); }; });
}

}  // namespace

void add_experiment(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("experiment", "hold many models against many pictures");
    command->require_subcommand(1);
    add_run(*command, action);
    add_table(*command, action);
    add_merge(*command, action);
    add_report(*command, action);
    add_forget(*command, action);
    for (CLI::App* part : command->get_subcommands({})) part->fallthrough();
    set_guide(*command, {.usual = {{"btfield experiment run sand.json --out sand.db"},
                                   {"btfield experiment table sand.db"}},
                         .notes = {"'btfield experiment COMMAND --help' shows the options of a command."}});
}

}  // namespace btfield::cli
