#include "host/experiment/results_database.hpp"

#include <ctime>
#include <utility>

#include "btfield/error.hpp"
#include "host/experiment/angles.hpp"
#include "host/experiment/picture_place.hpp"
#include "host/experiment/set_pictures.hpp"
#include "host/experiment/sha256.hpp"

namespace btfield::detail {
namespace {

namespace fs = std::filesystem;

constexpr int application_id = 0x62746664;  // "btfd"

// A row of `jobs` is named by a hash of all that its comparable columns depend on.
const char* const schema = R"sql(
CREATE TABLE configurations(
    id TEXT PRIMARY KEY, name TEXT NOT NULL, folder TEXT NOT NULL, text TEXT NOT NULL, started TEXT NOT NULL
) STRICT;
CREATE TABLE files(
    folder TEXT NOT NULL, name TEXT NOT NULL, crop TEXT NOT NULL, material TEXT NOT NULL, white REAL NOT NULL,
    content TEXT NOT NULL, picture TEXT NOT NULL, PRIMARY KEY(folder, name, crop)
) STRICT, WITHOUT ROWID;
CREATE TABLE pictures(
    picture TEXT PRIMARY KEY, width INTEGER NOT NULL, height INTEGER NOT NULL, planes INTEGER NOT NULL, kappa REAL
) STRICT, WITHOUT ROWID;
CREATE TABLE jobs(
    key TEXT PRIMARY KEY, picture TEXT NOT NULL,
    model TEXT NOT NULL, "order" INTEGER NOT NULL, levels INTEGER NOT NULL, estimator TEXT NOT NULL,
    marginals TEXT NOT NULL, metric TEXT NOT NULL, seed INTEGER NOT NULL, settings TEXT NOT NULL,
    status TEXT NOT NULL CHECK(status IN ('done', 'refused', 'failed')), reason TEXT NOT NULL,
    certified INTEGER, min_singular REAL, zeros INTEGER, lowest_ratio REAL, highest_ratio REAL,
    estimators TEXT, fitted_levels INTEGER, parameters INTEGER,
    memd REAL, memd_star REAL, variance_ratio REAL, lag_covariance_error REAL, spectral_covariance_error REAL,
    clamped_pixels INTEGER,
    fit_seconds REAL, synthesis_seconds REAL, memd_seconds REAL, finished TEXT NOT NULL, device TEXT NOT NULL,
    software TEXT NOT NULL,
    CHECK(status <> 'done' OR memd_star IS NOT NULL)
) STRICT, WITHOUT ROWID;
CREATE INDEX jobs_by_picture ON jobs(picture, status);
CREATE TABLE textures(
    picture TEXT NOT NULL, model TEXT NOT NULL, marginals TEXT NOT NULL, metric TEXT NOT NULL, key TEXT NOT NULL,
    file TEXT NOT NULL, PRIMARY KEY(picture, model, marginals, metric)
) STRICT, WITHOUT ROWID;
CREATE VIEW results AS
    SELECT files.material, files.name, files.crop, pictures.kappa, jobs.key, jobs.model, jobs."order", jobs.levels,
           jobs.estimator, jobs.marginals, jobs.metric, jobs.seed, jobs.settings, jobs.status, jobs.reason,
           jobs.certified, jobs.min_singular, jobs.zeros, jobs.lowest_ratio, jobs.highest_ratio, jobs.estimators,
           jobs.fitted_levels, jobs.parameters, jobs.memd, jobs.memd_star, jobs.variance_ratio,
           jobs.lag_covariance_error, jobs.spectral_covariance_error, jobs.clamped_pixels
    FROM jobs JOIN files ON files.picture = jobs.picture LEFT JOIN pictures ON pictures.picture = jobs.picture
    ORDER BY files.material, files.name, files.crop, jobs.key;
)sql";

// Of databases that older versions made too.
const char* const additions = R"sql(
CREATE TABLE IF NOT EXISTS runs(
    configuration TEXT PRIMARY KEY, number INTEGER NOT NULL, started TEXT NOT NULL
) STRICT, WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS members(
    configuration TEXT NOT NULL, folder TEXT NOT NULL, name TEXT NOT NULL, crop TEXT NOT NULL,
    material TEXT NOT NULL, picture TEXT NOT NULL, PRIMARY KEY(configuration, folder, name, crop)
) STRICT, WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS wanted(
    configuration TEXT NOT NULL, settings TEXT NOT NULL, PRIMARY KEY(configuration, settings)
) STRICT, WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS places(folder TEXT PRIMARY KEY, near TEXT NOT NULL) STRICT, WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS directions(
    folder TEXT NOT NULL, name TEXT NOT NULL, crop TEXT NOT NULL, btf TEXT NOT NULL, reading TEXT NOT NULL,
    view_theta REAL NOT NULL, view_phi REAL NOT NULL, light_theta REAL NOT NULL, light_phi REAL NOT NULL,
    PRIMARY KEY(folder, name, crop)
) STRICT, WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS stamps(
    place TEXT PRIMARY KEY, stamp TEXT NOT NULL, content TEXT NOT NULL, width INTEGER NOT NULL,
    height INTEGER NOT NULL, planes INTEGER NOT NULL
) STRICT, WITHOUT ROWID;
)sql";

std::string now() {
    const std::time_t time = std::time(nullptr);
    std::tm parts{};
    ::gmtime_r(&time, &parts);
    char text[32];
    return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts)};
}

std::string configuration_id(const ExperimentConfig& config) {
    return sha256(config.folder.string() + "\n" + config.text);
}

/// The folder that the name is relative to; none of a name that is a whole path.
std::string folder_of(const PictureSource& source) {
    std::string folder = source.file.string();
    const std::string& own = source.direction ? source.direction->set_name : source.name;
    if (own == folder) return {};
    folder.resize(folder.size() - own.size());
    return folder;
}

void add_facts(Connection& connection, const PictureFacts& facts) {
    Statement(connection, "INSERT OR REPLACE INTO pictures VALUES (?, ?, ?, ?, ?)")
        .bind(facts.picture)
        .bind_number(facts.size.width)
        .bind_number(facts.size.height)
        .bind_number(facts.planes)
        .bind(facts.kappa)
        .run();
}

void add_jobs(Connection& connection, const std::vector<JobResult>& results) {
    Statement forget(connection, "DELETE FROM jobs WHERE key = ? AND status = 'failed'");
    Statement insert(
        connection,
        "INSERT INTO jobs VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, "
        "?, ?, ?, ?, ?, ?, ?, ?, ?)");
    for (const JobResult& result : results) {
        forget.bind(result.key).run();
        const JobSettings& settings = result.settings;
        insert.bind(result.key)
            .bind(result.picture)
            .bind(name(settings.model))
            .bind_number(settings.order)
            .bind_number(settings.levels)
            .bind(name(settings.estimator))
            .bind(marginals_text(settings))
            .bind(result.metric)
            .bind_number(static_cast<std::int64_t>(settings.seed))
            .bind(result.settings_text)
            .bind(name(result.status))
            .bind(result.reason)
            .bind(result.valid)
            .bind(result.min_singular)
            .bind(result.zeros)
            .bind(result.lowest_ratio)
            .bind(result.highest_ratio)
            .bind(result.estimators)
            .bind(result.fitted_levels)
            .bind(result.parameters)
            .bind(result.memd)
            .bind(result.memd_star)
            .bind(result.variance_ratio)
            .bind(result.lag_covariance_error)
            .bind(result.spectral_covariance_error)
            .bind(result.clamped_pixels)
            .bind(result.fit_seconds)
            .bind(result.synthesis_seconds)
            .bind(result.memd_seconds)
            .bind(now())
            .bind(result.device)
            .bind("btfield " BTFIELD_VERSION)
            .run();
    }
}

void add_textures(Connection& connection, const std::vector<KeptTexture>& textures) {
    Statement keep(connection, "INSERT OR REPLACE INTO textures VALUES (?, ?, ?, ?, ?, ?)");
    for (const KeptTexture& kept : textures) {
        keep.bind(kept.picture)
            .bind(kept.model)
            .bind(kept.marginals)
            .bind(kept.metric)
            .bind(kept.key)
            .bind(kept.file)
            .run();
    }
}

void add_files(Connection& connection, const std::vector<PictureSource>& sources) {
    Statement insert(connection, "INSERT OR REPLACE INTO files VALUES (?, ?, ?, ?, ?, ?, ?)");
    for (const PictureSource& source : sources) {
        insert.bind(folder_of(source))
            .bind(source.name)
            .bind(crop_text(source.crop))
            .bind(source.material)
            .bind(source.white)
            .bind(source.content)
            .bind(source.picture)
            .run();
    }
    Statement direct(connection, "INSERT OR REPLACE INTO directions VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)");
    for (const PictureSource& source : sources) {
        if (!source.direction) continue;
        const auto [view, light] = source.direction->at;
        direct.bind(folder_of(source))
            .bind(source.name)
            .bind(crop_text(source.crop))
            .bind(source.direction->set_name)
            .bind(reading_text(source.direction->reading))
            .bind(in_degrees(view.theta))
            .bind(in_degrees(view.phi))
            .bind(in_degrees(light.theta))
            .bind(in_degrees(light.phi))
            .run();
    }
}

/// Places of another database, seen from this one; of one that has none, those of its absolute paths.
void absorb_places(Connection& connection, const fs::path& other, const fs::path& own) {
    const bool has = connection.number("SELECT count(*) FROM other.sqlite_schema WHERE name = 'places'") > 0;
    if (!has) return;
    std::map<std::string, std::string> places;
    {
        Statement query(connection, "SELECT folder, near FROM other.places");
        while (query.step()) {
            const fs::path place = fs::absolute(other).parent_path() / query.text(1);
            places.emplace(query.text(0), seen_from(own, place.lexically_normal().string()));
        }
    }
    Statement insert(connection, "INSERT OR IGNORE INTO places VALUES (?, ?)");
    for (const auto& [folder, near] : places) insert.bind(folder).bind(near).run();
}

}  // namespace

void check_results(Connection& connection) {
    if (connection.number("PRAGMA application_id") != application_id) {
        throw InputError(connection.asked(), "it is no database of experiments",
                         "give a file that `btfield experiment run` wrote");
    }
    const std::int64_t version = connection.number("PRAGMA user_version");
    if (version != results_schema) {
        throw InputError(connection.asked(),
                         "its schema is version " + std::to_string(version) +
                             ", this btfield reads version " + std::to_string(results_schema),
                         "use the btfield that wrote it");
    }
    Statement check(connection, "PRAGMA quick_check(1)");
    const std::string found = check.step() ? check.text(0) : "ok";
    if (found != "ok") {
        throw InputError(connection.asked(), "the database is damaged (" + found + ")",
                         "restore it from a copy, or run the experiment into a new one");
    }
}

ResultsDatabase::NewFile::NewFile(fs::path file) : path(std::move(file)) {
    std::error_code error;
    keep = fs::exists(path, error);
}

ResultsDatabase::NewFile::~NewFile() {
    if (keep) return;
    for (const char* suffix : {"", "-wal", "-shm"}) {
        std::error_code error;
        fs::remove(path.string() + suffix, error);
    }
}

ResultsDatabase::ResultsDatabase(const fs::path& path, const std::string& asked)
    : path_(path), lock_(path, asked), file_(path), connection_(path, Connection::Access::create, asked) {
    if (connection_.number("PRAGMA application_id") == 0 &&
        connection_.number("SELECT count(*) FROM sqlite_schema") == 0) {
        connection_.execute("PRAGMA journal_mode = WAL");
        Transaction transaction(connection_);
        connection_.execute(schema);
        connection_.execute(("PRAGMA application_id = " + std::to_string(application_id) +
                             "; PRAGMA user_version = " + std::to_string(results_schema))
                                .c_str());
        transaction.commit();
    }
    check_results(connection_);
    connection_.execute(additions);
    // A killed process loses nothing that was committed; only a power cut could take the last commits.
    connection_.execute("PRAGMA journal_mode = WAL; PRAGMA synchronous = NORMAL");
}

void ResultsDatabase::add(const ExperimentConfig& config) {
    Statement(connection_, "INSERT OR IGNORE INTO configurations VALUES (?, ?, ?, ?, ?)")
        .bind(configuration_id(config))
        .bind(config.name)
        .bind(config.folder.string())
        .bind(config.text)
        .bind(now())
        .run();
}

void ResultsDatabase::add(const ExperimentConfig& config, const std::vector<PictureSource>& sources) {
    Transaction transaction(connection_);
    add(config);
    add_files(connection_, sources);
    note_run(config, sources);
    transaction.commit();
}

void ResultsDatabase::add(const std::vector<PictureSource>& sources) {
    Transaction transaction(connection_);
    add_files(connection_, sources);
    transaction.commit();
}

void ResultsDatabase::note_run(const ExperimentConfig& config, const std::vector<PictureSource>& sources) {
    const std::string id = configuration_id(config);
    const std::int64_t number = connection_.number("SELECT COALESCE(max(number), 0) + 1 FROM runs");
    Statement(connection_, "INSERT OR REPLACE INTO runs VALUES (?, ?, ?)")
        .bind(id)
        .bind_number(number)
        .bind(now())
        .run();
    // What the same configuration found before, here or in a folder that it was moved from.
    for (const char* statement :
         {"DELETE FROM members WHERE configuration IN (SELECT id FROM configurations WHERE text = ?)",
          "DELETE FROM wanted WHERE configuration IN (SELECT id FROM configurations WHERE text = ?)"})
        Statement(connection_, statement).bind(config.text).run();
    Statement want(connection_, "INSERT OR IGNORE INTO wanted VALUES (?, ?)");
    for (const JobSettings& settings : job_settings(config))
        want.bind(id).bind(settings_text(config, settings)).run();
    Statement insert(connection_, "INSERT INTO members VALUES (?, ?, ?, ?, ?, ?)");
    std::set<std::string> folders;
    for (const PictureSource& source : sources) {
        const std::string folder = folder_of(source);
        folders.insert(folder.empty() ? source.file.parent_path().string() : folder);
        insert.bind(id)
            .bind(folder)
            .bind(source.name)
            .bind(crop_text(source.crop))
            .bind(source.material)
            .bind(source.picture)
            .run();
    }
    for (const std::string& folder : folders) note_place(folder);
}

void ResultsDatabase::note_place(const std::string& folder) {
    std::string plain = folder;
    while (plain.size() > 1 && plain.back() == '/') plain.pop_back();
    Statement(connection_, "INSERT OR REPLACE INTO places VALUES (?, ?)")
        .bind(plain)
        .bind(seen_from(path_, plain))
        .run();
}

void ResultsDatabase::add(const WorkReport& report) {
    Transaction transaction(connection_);
    if (report.facts) add_facts(connection_, *report.facts);
    add_jobs(connection_, report.results);
    add_textures(connection_, report.kept);
    std::set<std::string> folders;
    for (const KeptTexture& kept : report.kept) folders.insert(fs::path(kept.file).parent_path().string());
    for (const std::string& folder : folders) note_place(folder);
    transaction.commit();
}

std::map<std::string, JobStatus> ResultsDatabase::jobs_of(const std::string& picture) {
    std::map<std::string, JobStatus> jobs;
    Statement query(connection_, "SELECT key, status FROM jobs WHERE picture = ?");
    query.bind(picture);
    while (query.step()) jobs.emplace(query.text(0), job_status(query.text(1)));
    return jobs;
}

KnownPictures ResultsDatabase::known_pictures() {
    KnownPictures known;
    Statement query(connection_, "SELECT place, stamp, content, width, height, planes FROM stamps");
    while (query.step())
        known.emplace(query.text(0),
                      KnownPicture{query.text(1),
                                   query.text(2),
                                   {{static_cast<int>(query.number(4)), static_cast<int>(query.number(3))},
                                    static_cast<int>(query.number(5))}});
    return known;
}

void ResultsDatabase::keep(const KnownPictures& pictures) {
    Transaction transaction(connection_);
    Statement insert(connection_, "INSERT OR REPLACE INTO stamps VALUES (?, ?, ?, ?, ?, ?)");
    for (const auto& [place, picture] : pictures)
        insert.bind(place)
            .bind(picture.stamp)
            .bind(picture.content)
            .bind_number(picture.shape.size.width)
            .bind_number(picture.shape.size.height)
            .bind_number(picture.shape.planes)
            .run();
    transaction.commit();
}

std::optional<PictureShape> ResultsDatabase::shape_of(const std::string& picture) {
    Statement query(connection_, "SELECT height, width, planes FROM pictures WHERE picture = ?");
    query.bind(picture);
    if (!query.step()) return std::nullopt;
    return PictureShape{{static_cast<int>(query.number(0)), static_cast<int>(query.number(1))},
                        static_cast<int>(query.number(2))};
}

std::vector<std::string> ResultsDatabase::best_not_kept(const std::string& picture,
                                                        const std::set<std::string>& keys,
                                                        const fs::path& folder) {
    std::set<std::vector<std::string>> seen;  // model, marginals and metric
    std::vector<std::string> best;
    Statement query(connection_, R"sql(
        SELECT jobs.key, jobs.model, jobs.marginals, jobs.metric, textures.file FROM jobs
        LEFT JOIN textures USING (picture, model, marginals, metric, key)
        WHERE jobs.status = 'done' AND jobs.picture = ? ORDER BY jobs.memd_star, jobs.key)sql");
    query.bind(picture);
    while (query.step()) {
        if (keys.count(query.text(0)) == 0 ||
            !seen.insert({query.text(1), query.text(2), query.text(3)}).second)
            continue;
        std::error_code error;
        const fs::path file = query.text(4);
        const bool kept = !query.is_null(4) && fs::exists(file, error) &&
                          file.lexically_relative(folder).native().rfind("..", 0) != 0;
        if (!kept) best.push_back(query.text(0));
    }
    return best;
}

void ResultsDatabase::absorb(const fs::path& other) {
    const std::string asked = "merge the results '" + other.string() + "'";
    {
        Connection source(other, Connection::Access::read, asked);
        check_results(source);
    }
    Statement(connection_, "ATTACH ? AS other").bind(other.string()).run();
    {
        Transaction transaction(connection_);
        connection_.execute(R"sql(
            INSERT OR IGNORE INTO configurations SELECT * FROM other.configurations;
            INSERT OR IGNORE INTO files SELECT * FROM other.files;
            INSERT OR IGNORE INTO pictures SELECT * FROM other.pictures;
            DELETE FROM jobs WHERE status = 'failed' AND key IN (SELECT key FROM other.jobs WHERE status <> 'failed');
            INSERT OR IGNORE INTO jobs SELECT * FROM other.jobs;
            INSERT OR REPLACE INTO textures
                SELECT theirs.* FROM other.textures AS theirs JOIN jobs AS their_job ON their_job.key = theirs.key
                LEFT JOIN textures AS ours USING (picture, model, marginals, metric)
                LEFT JOIN jobs AS our_job ON our_job.key = ours.key
                WHERE ours.key IS NULL
                   OR (their_job.memd_star, their_job.key) < (our_job.memd_star, our_job.key);
        )sql");
        if (connection_.number("SELECT count(*) FROM other.sqlite_schema WHERE name = 'members'") > 0) {
            connection_.execute(R"sql(
                INSERT OR IGNORE INTO members SELECT * FROM other.members;
                INSERT OR IGNORE INTO wanted SELECT * FROM other.wanted;
                INSERT INTO runs SELECT * FROM other.runs WHERE true
                    ON CONFLICT(configuration) DO UPDATE SET
                        number = max(number, excluded.number), started = max(started, excluded.started);
            )sql");
        }
        if (connection_.number("SELECT count(*) FROM other.sqlite_schema WHERE name = 'directions'") > 0)
            connection_.execute("INSERT OR IGNORE INTO directions SELECT * FROM other.directions");
        absorb_places(connection_, other, path_);
        transaction.commit();
    }
    connection_.execute("DETACH other");
}

std::map<JobStatus, std::uint64_t> ResultsDatabase::count() {
    std::map<JobStatus, std::uint64_t> counts;
    Statement query(connection_, "SELECT status, count(*) FROM jobs GROUP BY status");
    while (query.step()) counts[job_status(query.text(0))] = static_cast<std::uint64_t>(query.number(1));
    return counts;
}

void ResultsDatabase::close() {
    connection_.execute("PRAGMA wal_checkpoint(TRUNCATE)");
    file_.keep = true;
}

}  // namespace btfield::detail
