#pragma once

/// \file
/// The results of experiments on disk (docs/experiments.md has the schema).

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "host/experiment/jobs.hpp"
#include "host/experiment/run_lock.hpp"
#include "host/experiment/sqlite.hpp"

namespace btfield::detail {

/// Schema that this version writes, and the only one it reads. Tables that were added to it later (runs,
/// members, wanted, places, directions, stamps) are made where they are missing, and done without by who only
/// reads.
inline constexpr int results_schema = 1;

/// Writes rows. One process at a time: it holds a lock as long as it lives, and readers do not mind.
class ResultsDatabase {
  public:
    /// Opens the database, or makes one where the file is absent or empty. A new one is removed again unless
    /// it gets results or is closed.
    /// \throws InputError when it is another program's, damaged, locked by another run, or cannot be written.
    ResultsDatabase(const std::filesystem::path& path, const std::string& asked);

    void add(const ExperimentConfig& config);
    /// The configuration, its pictures, and that it is run now: in one transaction.
    void add(const ExperimentConfig& config, const std::vector<PictureSource>& sources);
    /// Names, materials and identities of the pictures; an entry of the same name is replaced.
    void add(const std::vector<PictureSource>& sources);
    /// In one transaction. A row of a failed job is replaced, one that is done or refused never: adding it
    /// again is an error.
    void add(const WorkReport& report);

    /// Pictures of BTFs that runs have read, as they were then.
    [[nodiscard]] KnownPictures known_pictures();
    void keep(const KnownPictures& pictures);

    /// Of a picture that was read before; nothing of others.
    [[nodiscard]] std::optional<PictureShape> shape_of(const std::string& picture);
    /// Status of every job of the picture, by key.
    [[nodiscard]] std::map<std::string, JobStatus> jobs_of(const std::string& picture);
    /// Jobs with the least MEMD* of each model, metric and marginals of the picture whose textures are not in
    /// the folder.
    /// \param keys of the jobs to choose from
    [[nodiscard]] std::vector<std::string> best_not_kept(const std::string& picture,
                                                         const std::set<std::string>& keys,
                                                         const std::filesystem::path& folder);

    /// See forget_jobs().
    [[nodiscard]] ForgottenJobs forget(const ExperimentForget& which);

    /// Takes over what another database has, rows that are done or refused before those that failed.
    void absorb(const std::filesystem::path& other);
    /// Jobs of each status.
    [[nodiscard]] std::map<JobStatus, std::uint64_t> count();
    /// Moves the log into the file.
    void close();

  private:
    struct NewFile {
        explicit NewFile(std::filesystem::path file);
        ~NewFile();
        NewFile(const NewFile&) = delete;
        NewFile& operator=(const NewFile&) = delete;
        std::filesystem::path path;
        bool keep;
    };
    void note_run(const ExperimentConfig& config, const std::vector<PictureSource>& sources);
    void note_place(const std::string& folder);
    std::filesystem::path path_;
    RunLock lock_;
    NewFile file_;  ///< outlives the connection
    Connection connection_;
};

/// Opens for reading and checks the schema and every page.
void check_results(Connection& connection);

}  // namespace btfield::detail
