#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "btfield/experiment.hpp"
#include "host/base/text.hpp"
#include "host/cli/btf_parts.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/experiment_parts.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"
#include "host/cli/run_files.hpp"
#include "host/experiment/experiment_names.hpp"

namespace btfield::cli {
namespace {

struct TableOptions {
    std::string database;
    ExperimentTableOptions tables;
    TableFormat format = TableFormat::text;
    bool json = false;
};

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
        for (std::size_t m = 0; m < row.std_ratio.size(); ++m)
            entry["std_ratio"][table.rows[m].model] = number(row.std_ratio[m]);
        if (row.directions) {
            entry["view"] = degrees_json(row.directions->view);
            entry["light"] = degrees_json(row.directions->light);
        }
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

struct ReportOptions {
    std::string database, page;
    ExperimentTableOptions tables;
    int pictures = 24;
    bool overwrite = false, json = false;
};

}  // namespace

void add_experiment_table(CLI::App& parent, Action& action) {
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

void add_experiment_report(CLI::App& parent, Action& action) {
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

}  // namespace btfield::cli
