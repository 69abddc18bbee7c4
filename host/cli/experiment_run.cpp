#include <atomic>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "btfield/error.hpp"
#include "btfield/experiment.hpp"
#include "host/base/text.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/ending.hpp"
#include "host/cli/experiment_parts.hpp"
#include "host/cli/mpi_ranks.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {
namespace {

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

/// Jobs that are done, and when the others will be. A run takes hours: its log tells that with --json too.
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
        const double share = progress.jobs == 0 ? 0.0
                                                : static_cast<double>(progress.skipped + finished) /
                                                      static_cast<double>(progress.jobs);
        const std::string ready = std::to_string(progress.skipped + finished);
        bar_.show(share, ready + "/" + std::to_string(progress.jobs) + ", " + text,
                  ready + " of " + detail::counted(progress.jobs, "job") + ": " + text);
    }

  private:
    Progress bar_{Progress::Lines::always};
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

struct MergeOptions {
    std::vector<std::string> inputs;
    std::string output;
    bool json = false;
};

}  // namespace

void add_experiment_run(CLI::App& parent, Action& action) {
    CLI::App* command =
        parent.add_subcommand("run", "fit, synthesise and measure all that a configuration lists");
    const auto options = std::make_shared<RunOptions>();
    command->add_option("CONFIG", options->config, "configuration, JSON: see docs/experiments.md")
        ->required()
        ->type_name("");
    command->add_option("-o,--out", options->database, "database of results; one that exists is completed")
        ->required()
        ->type_name("RESULTS.db");
    add_shard(
        *command,
        [options](Shard shard) {
            options->run.shard = shard.index;
            options->run.shards = shard.count;
        },
        "only part I of N, into a database of its own; `experiment merge` joins them");
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

void add_experiment_merge(CLI::App& parent, Action& action) {
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

}  // namespace btfield::cli
