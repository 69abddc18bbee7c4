#include <algorithm>
#include <set>

#include "btfield/error.hpp"
#include "btfield/experiment.hpp"
#include "host/criteria/metric_names.hpp"
#include "host/experiment/experiment_names.hpp"
#include "host/experiment/results_database.hpp"
#include "host/experiment/scope.hpp"
#include "host/fit/fit_names.hpp"

namespace btfield {

using namespace detail;

namespace {

constexpr std::size_t shortest_hash = 8;

/// Pictures that the database names, with what it calls them.
struct Named {
    std::string name, crop, material, picture;
};

std::vector<Named> named_pictures(Connection& connection) {
    std::vector<Named> all;
    const bool has_members =
        connection.number("SELECT count(*) FROM sqlite_schema WHERE name = 'members'") > 0;
    Statement query(connection,
                    std::string("SELECT name, crop, material, picture FROM main.files") +
                        (has_members ? " UNION SELECT name, crop, material, picture FROM main.members" : "") +
                        " ORDER BY name, crop");
    while (query.step()) all.push_back({query.text(0), query.text(1), query.text(2), query.text(3)});
    return all;
}

/// Pictures that the words stand for, each of which has to stand for some.
template <class Matches>
std::set<std::string> matching(const std::vector<Named>& all, const std::vector<std::string>& words,
                               const std::string& what, const std::string& asked, const Matches& matches) {
    std::set<std::string> found;
    for (const std::string& word : words) {
        bool any = false;
        for (const Named& named : all) {
            if (!matches(word, named)) continue;
            found.insert(named.picture);
            any = true;
        }
        if (!any)
            throw InputError(asked, "no " + what + " is called '" + word + "'",
                             "see 'btfield experiment table' and 'report' for the names");
    }
    return found;
}

/// Temporary tables of one column.
void fill(Connection& connection, const std::string& table, const std::set<std::string>& values) {
    connection.execute(("DROP TABLE IF EXISTS temp." + table + "; CREATE TEMP TABLE " + table +
                        "(value TEXT PRIMARY KEY) WITHOUT ROWID")
                           .c_str());
    Statement insert(connection, "INSERT INTO " + table + " VALUES (?)");
    for (const std::string& value : values) insert.bind(value).run();
}

/// Adds "column IN (…)" to the condition; the words are those of enumerations and numbers.
template <class Value, class Text>
void add_list(std::string& condition, const std::string& column, const std::vector<Value>& values,
              const Text& text) {
    if (values.empty()) return;
    condition += " AND " + column + " IN (";
    for (std::size_t i = 0; i < values.size(); ++i) condition += (i == 0 ? "" : ", ") + text(values[i]);
    condition += ")";
}

std::string condition_of(const ExperimentForget& which) {
    const auto word = [](auto value) { return "'" + std::string(word_of(value)) + "'"; };
    const auto number = [](auto value) { return std::to_string(value); };
    const auto setting = [](const char* key) {
        return "CASE WHEN json_valid(settings) THEN json_extract(settings, '$." + std::string(key) + "') END";
    };
    std::string condition = "true";
    add_list(condition, "model", which.models, word);
    add_list(condition, "\"order\"", which.orders, number);
    add_list(condition, "levels", which.levels, number);
    add_list(condition, "estimator", which.estimators, word);
    add_list(condition, "marginals", which.marginals, word);
    add_list(condition, setting("noise"), which.noise, word);
    add_list(condition, setting("gains"), which.gains, word);
    add_list(condition, "metric", which.metrics, word);
    add_list(condition, "seed", which.seeds, number);
    std::vector<JobStatus> states;
    if (which.failed) states.push_back(JobStatus::failed);
    if (which.refused) states.push_back(JobStatus::refused);
    add_list(condition, "status", states, word);
    return condition;
}

void count_forgotten(Connection& connection, const std::vector<Named>& names, ForgottenJobs& forgotten) {
    Statement query(connection, R"sql(
        SELECT picture, model, status, count(*) FROM main.jobs
        WHERE key IN (SELECT value FROM forgotten) GROUP BY picture, model, status)sql");
    while (query.step()) {
        const std::string picture = query.text(0);
        const auto named = std::ranges::find(names, picture, &Named::picture);
        const std::string title = named == names.end()
                                      ? picture
                                      : named->name + (named->crop.empty() ? "" : " [" + named->crop + "]");
        auto part = std::ranges::find_if(forgotten.parts, [&](const ForgottenJobs::Part& known) {
            return known.picture == title && known.model == query.text(1);
        });
        if (part == forgotten.parts.end())
            part = forgotten.parts.insert(part, {title, query.text(1), 0, 0, 0});
        const auto jobs = static_cast<std::uint64_t>(query.number(3));
        const JobStatus status = job_status(query.text(2));
        (status == JobStatus::done      ? part->done
         : status == JobStatus::refused ? part->refused
                                        : part->failed) += jobs;
        (status == JobStatus::done      ? forgotten.done
         : status == JobStatus::refused ? forgotten.refused
                                        : forgotten.failed) += jobs;
        forgotten.jobs += jobs;
    }
    const auto place = [](const std::string& model) {
        const auto known = find_value<ExperimentModel>(model);
        return known ? static_cast<int>(*known) : -1;
    };
    std::ranges::sort(forgotten.parts, [&](const auto& a, const auto& b) {
        return a.picture != b.picture ? a.picture < b.picture : place(a.model) < place(b.model);
    });
    forgotten.left =
        static_cast<std::uint64_t>(connection.number("SELECT count(*) FROM main.jobs")) - forgotten.jobs;
    forgotten.textures = static_cast<std::uint64_t>(
        connection.number("SELECT count(*) FROM main.textures WHERE key IN (SELECT value FROM forgotten)"));
}

/// Names them in the temporary table `forgotten`, and counts.
ForgottenJobs select_jobs(Connection& connection, const ExperimentForget& which) {
    const TemporaryWrites allowed(connection);
    const std::string& asked = connection.asked();
    std::string condition = condition_of(which);
    const std::vector<Named> names = named_pictures(connection);
    if (!which.pictures.empty()) {
        fill(connection, "asked_pictures",
             matching(names, which.pictures, "picture", asked,
                      [](const std::string& word, const Named& named) {
                          return names_picture(word, named.name) ||
                                 (word.size() >= shortest_hash && named.picture.rfind(word, 0) == 0);
                      }));
        condition += " AND picture IN (SELECT value FROM asked_pictures)";
    }
    if (!which.materials.empty()) {
        fill(connection, "asked_materials",
             matching(names, which.materials, "material", asked,
                      [](const std::string& word, const Named& named) { return word == named.material; }));
        condition += " AND picture IN (SELECT value FROM asked_materials)";
    }
    if (which.stale) {
        const std::vector<RecordedConfiguration> known = recorded_configurations(connection);
        if (known.empty())
            throw InputError(asked, "the database has no configuration",
                             "say by other options what to forget");
        enter_scope(connection, known.front());
        condition += " AND key NOT IN (SELECT key FROM scope_jobs)";
    }
    fill(connection, "forgotten", {});
    connection.execute(("INSERT INTO forgotten SELECT key FROM main.jobs WHERE " + condition).c_str());
    ForgottenJobs forgotten;
    count_forgotten(connection, names, forgotten);
    return forgotten;
}

/// Configurations but the last one that no job is of.
void forget_configurations(Connection& connection) {
    const std::vector<RecordedConfiguration> known = recorded_configurations(connection);
    for (std::size_t i = 1; i < known.size(); ++i) {
        try {
            enter_scope(connection, known[i]);
        } catch (const InputError&) {
            continue;  // nobody knows what it is about
        }
        if (connection.number("SELECT count(*) FROM scope_jobs") > 0) continue;
        for (const std::string& id : known[i].ids) {
            for (const char* statement : {"DELETE FROM main.members WHERE configuration = ?",
                                          "DELETE FROM main.wanted WHERE configuration = ?",
                                          "DELETE FROM main.runs WHERE configuration = ?",
                                          "DELETE FROM main.configurations WHERE id = ?"})
                Statement(connection, statement).bind(id).run();
        }
    }
}

}  // namespace

ForgottenJobs detail::ResultsDatabase::forget(const ExperimentForget& which) {
    Transaction transaction(connection_);
    ForgottenJobs forgotten = select_jobs(connection_, which);
    if (forgotten.jobs > 0) {
        connection_.execute(R"sql(
            DROP TABLE IF EXISTS temp.touched;
            CREATE TEMP TABLE touched AS
                SELECT DISTINCT picture FROM main.jobs WHERE key IN (SELECT value FROM forgotten);
            DELETE FROM main.textures WHERE key IN (SELECT value FROM forgotten);
            DELETE FROM main.jobs WHERE key IN (SELECT value FROM forgotten);
            DELETE FROM touched WHERE picture IN (SELECT picture FROM main.jobs);
            DELETE FROM main.pictures WHERE picture IN (SELECT picture FROM touched);
        )sql");
        forget_configurations(connection_);
        connection_.execute(R"sql(
            DELETE FROM main.files WHERE picture IN (SELECT picture FROM touched)
                AND picture NOT IN (SELECT picture FROM main.members);
            DELETE FROM main.directions WHERE (folder, name, crop) NOT IN (
                SELECT folder, name, crop FROM main.files UNION SELECT folder, name, crop FROM main.members);
        )sql");
    }
    transaction.commit();
    return forgotten;
}

ForgottenJobs forget_jobs(const std::filesystem::path& database, const ExperimentForget& which) {
    const std::string asked = "forget jobs of '" + database.string() + "'";
    if (which.is_empty())
        throw InputError(asked, "nothing says which",
                         "say by picture, model, setting or state which jobs to forget");
    if (which.dry_run) {
        Connection connection(database, Connection::Access::read, asked);
        check_results(connection);
        const Transaction one_state(connection, Transaction::Kind::read);
        return select_jobs(connection, which);
    }
    std::error_code error;
    if (!std::filesystem::exists(database, error))
        throw InputError(asked, "there is no such file", "give the database of an experiment");
    ResultsDatabase results(database, asked);
    ForgottenJobs forgotten = results.forget(which);
    results.close();
    return forgotten;
}

}  // namespace btfield
