#pragma once

/// \file
/// Which jobs are left, who works on what, and what came of it. The only user of the database during a run.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "host/experiment/results_database.hpp"

namespace btfield::detail {

/// Every member may be called from any thread.
class Ledger {
  public:
    /// Reads what the database has and plans the rest.
    /// \param workers threads of all ranks
    Ledger(const ExperimentConfig& config, const std::filesystem::path& database,
           const ExperimentRunOptions& options, OpenSets& sets, int workers);

    /// The next unit of work; nothing when there is none now: finished() tells whether one may still come.
    [[nodiscard]] std::optional<WorkUnit> next();
    /// As next(), and waits until there is one or finished().
    [[nodiscard]] std::optional<WorkUnit> wait_for_next();
    /// No unit will come any more: all are worked off, or stop() was called.
    [[nodiscard]] bool finished();
    /// Results, committed when this returns.
    /// \throws InputError when they cannot be; finished() from then on.
    void take(const WorkReport& report);
    /// A unit has ended, with all of its jobs reported unless stopped.
    void unit_ended();
    /// Hands out nothing more.
    void stop();

    [[nodiscard]] ExperimentProgress progress();
    /// The end of the run: tidies the database.
    /// \throws what take() threw; InputError when a texture could not be kept
    ExperimentResult conclude();

  private:
    struct Picture {
        PictureSource source;
        std::vector<std::uint32_t> pending;  ///< indices of settings_
        std::size_t handed_out = 0;          ///< of pending
        std::size_t outstanding = 0;         ///< jobs without a result
    };
    void plan(const std::vector<PictureSource>& sources);
    void plan_textures(const std::string& picture);
    [[nodiscard]] std::optional<WorkUnit> next_locked();
    [[nodiscard]] bool jobs_left();
    [[nodiscard]] bool finished_locked();

    ExperimentConfig config_;
    std::filesystem::path textures_;
    int shard_, shards_;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();

    std::mutex mutex_;
    std::condition_variable changed_;
    ResultsDatabase database_;
    std::vector<JobSettings> settings_;
    std::vector<Picture> pictures_;
    std::map<std::string, std::size_t> by_identity_;
    std::deque<WorkUnit> texture_units_;
    std::size_t current_ = 0;  ///< first picture with jobs to hand out
    std::size_t largest_unit_ = 0;
    int in_progress_ = 0;  ///< units
    bool stopped_ = false;
    ExperimentProgress progress_;
    std::string first_failure_, texture_trouble_;
    std::exception_ptr fatal_;
};

}  // namespace btfield::detail
