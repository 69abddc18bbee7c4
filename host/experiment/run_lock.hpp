#pragma once

/// \file
/// One writer at a time.

#include <filesystem>
#include <string>

namespace btfield::detail {

/// Holds FILE-lock, exclusively, until destroyed or until the process ends, however it ends. Not the file
/// itself: SQLite's own locks are lost when any descriptor of it is closed.
class RunLock {
  public:
    /// \throws InputError when another process holds it, or it cannot be made.
    RunLock(const std::filesystem::path& file, const std::string& asked);
    ~RunLock();
    RunLock(const RunLock&) = delete;
    RunLock& operator=(const RunLock&) = delete;

  private:
    std::filesystem::path path_;
    int descriptor_ = -1;
};

}  // namespace btfield::detail
