#pragma once

/// \file
/// The results of experiments on disk (docs/experiments.md has the schema).

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/experiment/jobs.hpp"
#include "host/experiment/run_lock.hpp"
#include "host/experiment/sqlite.hpp"

namespace btfield::detail {

/// Schema that this version writes, and the only one it reads.
inline constexpr int results_schema = 1;

/// Writes rows. One process at a time: it holds a lock as long as it lives, and readers do not mind.
class ResultsDatabase {
  public:
    /// Opens the database, or makes one where the file is absent or empty. A new one is removed again unless
    /// it gets results or is closed.
    /// \throws InputError when it is another program's, damaged, locked by another run, or cannot be written.
    ResultsDatabase(const std::filesystem::path& path, const std::string& asked);

    void add(const ExperimentConfig& config);
    /// Names, materials and identities of the pictures; an entry of the same name is replaced.
    void add(const std::vector<PictureSource>& sources);
    /// In one transaction. A row of a failed job is replaced, one that is done or refused never: adding it
    /// again is an error.
    void add(const WorkReport& report);

    /// Status of every job of the picture, by key.
    [[nodiscard]] std::map<std::string, JobStatus> jobs_of(const std::string& picture);
    /// Jobs with the least MEMD* of each model, metric and marginals of the picture whose textures are not in
    /// the folder.
    [[nodiscard]] std::vector<std::string> best_not_kept(const std::string& picture,
                                                         const std::filesystem::path& folder);

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
    RunLock lock_;
    NewFile file_;  ///< outlives the connection
    Connection connection_;
};

/// Opens for reading and checks the schema and every page.
void check_results(Connection& connection);

}  // namespace btfield::detail
