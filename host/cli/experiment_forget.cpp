#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "btfield/experiment.hpp"
#include "host/base/text_table.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/experiment_parts.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"
#include "host/criteria/metric_names.hpp"
#include "host/experiment/experiment_names.hpp"
#include "host/fit/fit_names.hpp"

namespace btfield::cli {
namespace {

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

}  // namespace

void add_experiment_forget(CLI::App& parent, Action& action) {
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

}  // namespace btfield::cli
