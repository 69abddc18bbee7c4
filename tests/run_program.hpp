#pragma once

#include <sys/resource.h>

#include <filesystem>
#include <string>
#include <vector>

namespace btfield::test {

/// How a program ended and what it said.
struct Ended {
    int code = -1;  ///< exit code; 128 + the signal that ended it
    std::string out, err;
};

/// What the program finds where it runs.
struct Surroundings {
    std::string folder{};               ///< working folder; empty = the caller's
    rlim_t file_limit = RLIM_INFINITY;  ///< no file can grow beyond this, as on a full disk
    std::string out{};                  ///< file for standard output in place of Ended::out
    bool close_out = false;             ///< standard output is closed
    bool terminal = false;              ///< standard error is a terminal
};

/// The other side of a terminal that a child may write to.
class Terminal {
  public:
    Terminal();
    ~Terminal();
    Terminal(const Terminal&) = delete;
    Terminal& operator=(const Terminal&) = delete;
    [[nodiscard]] const std::string& child_side() const { return child_side_; }
    /// What a user types, now or before the program on the other side begins to read.
    void type(const std::string& keys) const;
    /// All that was written, once the last writer has closed it.
    [[nodiscard]] std::string read() const;

  private:
    int descriptor_;
    std::string child_side_;
};

/// Between fork and exec: only calls that are safe there.
[[noreturn]] void become(char* const* arguments, const Surroundings& around, const char* out,
                         const char* err);

/// A program beside this one, which gets signals as at a terminal.
class Running {
  public:
    /// \param folder  gets what it says as child-out and child-err
    Running(std::vector<std::string> words, const std::filesystem::path& folder,
            const Surroundings& around = {});
    void kill(int signal) const;
    /// 128 + signal, or the exit code.
    int wait();
    [[nodiscard]] std::string err() const;

  private:
    std::vector<std::string> words_;
    std::string out_, err_;
    pid_t child_ = -1;
};

/// Runs the program to its end.
Ended run_program(std::vector<std::string> words, const Surroundings& around = {});

}  // namespace btfield::test
