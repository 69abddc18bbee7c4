#pragma once

/// \file
/// Files and folders that shall not outlive the process.

#include <filesystem>
#include <mutex>

namespace btfield::detail {

/// While one lives, no other does, and remove_temporaries() waits: what is made, renamed or removed on disk
/// during a step has happened together with its note.
class TemporaryStep {
  public:
    TemporaryStep();
    TemporaryStep(const TemporaryStep&) = delete;
    TemporaryStep& operator=(const TemporaryStep&) = delete;
    /// A file, or a folder with all in it, that is about to be made.
    void note(const std::filesystem::path& name) const;
    void forget(const std::filesystem::path& name) const noexcept;

  private:
    std::unique_lock<std::mutex> lock_;
};

/// Removes all that is noted, and lets no step begin from then on: for the end of a process that no
/// destructor sees.
void remove_temporaries() noexcept;

}  // namespace btfield::detail
