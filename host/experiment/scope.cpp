#include "host/experiment/scope.hpp"

#include <fnmatch.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "btfield/error.hpp"
#include "host/experiment/config_text.hpp"
#include "host/experiment/jobs.hpp"

namespace btfield::detail {
namespace {

namespace fs = std::filesystem;

bool has_table(Connection& connection, const char* name) {
    Statement query(connection, "SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name = ?");
    query.bind(name);
    return query.step();
}

std::string asked_for(const RecordedConfiguration& configuration) {
    return "read the configuration '" + configuration.name + "' of the database";
}

/// Databases that know no members: files whose names and crops the configuration would find.
void derive_places(Connection& connection, const ExperimentConfig& config) {
    Statement insert(connection, "INSERT OR IGNORE INTO scope_places VALUES (?, ?, ?, ?, ?)");
    Statement file(connection, "SELECT material, picture, folder, name, crop FROM main.files");
    std::string folder = config.folder.string();
    if (!folder.empty() && folder.back() != '/') folder += '/';
    while (file.step()) {
        const bool listed = std::ranges::any_of(config.pictures, [&](const ExperimentPictures& entry) {
            return entry.material == file.text(0) && crop_text(entry.crop) == file.text(4) &&
                   std::ranges::any_of(entry.files, [&](const std::string& pattern) {
                       const bool absolute = fs::path(pattern).is_absolute();
                       return file.text(2) == (absolute ? std::string() : folder) &&
                              (pattern == file.text(3) || ::fnmatch(pattern.c_str(), file.text(3).c_str(),
                                                                    FNM_PATHNAME | FNM_PERIOD) == 0);
                   });
        });
        if (!listed) continue;
        for (const int column : {0, 1, 2, 3, 4}) insert.bind(file.text(column));
        insert.run();
    }
}

void add_places(Connection& connection, const RecordedConfiguration& configuration) {
    std::int64_t found = 0;
    if (has_table(connection, "members")) {
        for (const std::string& id : configuration.ids) {
            Statement(connection,
                      "INSERT OR IGNORE INTO scope_places SELECT material, picture, folder, name, crop FROM "
                      "main.members WHERE configuration = ?")
                .bind(id)
                .run();
        }
        found = connection.number("SELECT count(*) FROM scope_places");
    }
    if (found > 0) return;
    for (const std::string& id : configuration.ids) {
        Statement folder(connection, "SELECT folder FROM main.configurations WHERE id = ?");
        folder.bind(id);
        if (folder.step())
            derive_places(connection,
                          experiment_from_text(configuration.text, folder.text(0), asked_for(configuration)));
    }
}

void add_settings(Connection& connection, const RecordedConfiguration& configuration) {
    if (has_table(connection, "wanted")) {
        for (const std::string& id : configuration.ids) {
            Statement(connection,
                      "INSERT OR IGNORE INTO scope_settings SELECT settings FROM main.wanted WHERE "
                      "configuration = ?")
                .bind(id)
                .run();
        }
    }
    if (connection.number("SELECT count(*) FROM scope_settings") > 0) return;
    const ExperimentConfig config = experiment_from_text(configuration.text, {}, asked_for(configuration));
    Statement insert(connection, "INSERT OR IGNORE INTO scope_settings VALUES (?)");
    for (const JobSettings& settings : job_settings(config))
        insert.bind(settings_text(config, settings)).run();
}

const char* const empty_scope = R"sql(
DROP VIEW IF EXISTS temp.scope_jobs;
DROP TABLE IF EXISTS temp.scope_places;
DROP TABLE IF EXISTS temp.scope_settings;
CREATE TEMP TABLE scope_places(
    material TEXT NOT NULL, picture TEXT NOT NULL, folder TEXT NOT NULL, name TEXT NOT NULL, crop TEXT NOT NULL,
    PRIMARY KEY(material, picture, folder, name, crop)
) WITHOUT ROWID;
CREATE INDEX temp.scope_pictures ON scope_places(picture);
CREATE TEMP TABLE scope_settings(settings TEXT PRIMARY KEY) WITHOUT ROWID;
CREATE TEMP VIEW scope_jobs AS
    SELECT *,
           COALESCE(CASE WHEN json_valid(settings) THEN json_extract(settings, '$.noise') END, 'any') AS noise,
           COALESCE(CASE WHEN json_valid(settings) THEN json_extract(settings, '$.gains') END, 'any') AS gains
    FROM main.jobs
    WHERE picture IN (SELECT picture FROM scope_places) AND settings IN (SELECT settings FROM scope_settings);
)sql";

}  // namespace

TemporaryWrites::TemporaryWrites(Connection& connection)
    : connection_(connection), reads_(connection.number("PRAGMA query_only") != 0) {
    if (reads_) connection_.execute("PRAGMA query_only = 0");
}

TemporaryWrites::~TemporaryWrites() {
    try {
        if (reads_) connection_.execute("PRAGMA query_only = 1");
    } catch (const InputError&) {
        // Nothing but temporary tables follows on such connections.
    }
}

std::vector<RecordedConfiguration> recorded_configurations(Connection& connection) {
    const bool counts_runs = has_table(connection, "runs");
    Statement query(connection, counts_runs ? R"sql(
        SELECT id, name, text, COALESCE(runs.started, configurations.started) AS last
        FROM configurations LEFT JOIN runs ON runs.configuration = configurations.id
        ORDER BY last DESC, runs.number DESC, configurations.rowid DESC)sql"
                                            : R"sql(
        SELECT id, name, text, started FROM configurations ORDER BY started DESC, rowid DESC)sql");
    std::vector<RecordedConfiguration> all;
    while (query.step()) {
        const std::string text = query.text(2);
        const auto twin = std::ranges::find(all, text, &RecordedConfiguration::text);
        if (twin != all.end()) {
            twin->ids.push_back(query.text(0));
        } else {
            all.push_back({query.text(1), text, {query.text(0)}, query.text(3)});
        }
    }
    return all;
}

void enter_scope(Connection& connection, const std::optional<RecordedConfiguration>& configuration) {
    const TemporaryWrites allowed(connection);
    connection.execute(empty_scope);
    if (configuration) {
        add_places(connection, *configuration);
        add_settings(connection, *configuration);
        return;
    }
    connection.execute(
        "INSERT INTO scope_places SELECT material, picture, folder, name, crop FROM main.files;"
        "INSERT INTO scope_settings SELECT DISTINCT settings FROM main.jobs");
}

bool names_picture(const std::string& pattern, const std::string& name) {
    const std::string file = fs::path(name).filename().string();
    return pattern == name || pattern == file ||
           ::fnmatch(pattern.c_str(), name.c_str(), FNM_PATHNAME) == 0 ||
           ::fnmatch(pattern.c_str(), file.c_str(), FNM_PATHNAME) == 0;
}

}  // namespace btfield::detail
