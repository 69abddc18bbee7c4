#pragma once

/// \file
/// What goes to standard output and standard error.

#include <chrono>
#include <condition_variable>
#include <initializer_list>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "btfield/image.hpp"
#include "btfield/progress.hpp"
#include "host/base/text_table.hpp"

namespace btfield::cli {

using detail::table;

/// Keeps the order in which keys are set.
using Json = nlohmann::ordered_json;

/// Writes the text to standard output and makes sure that it got there.
/// \throws InputError when it did not.
void emit_text(std::string_view text);
/// The object as one line of standard output.
void emit_json(const Json& object);

/// Answers about one or several inputs: the text, or as JSON the only object or all of them as a list under
/// `key`.
void emit_answers(bool json, const Json& objects, const std::string& key, std::string_view text);
/// The same of commands whose result is a file: their texts are left out after be_quiet().
void emit_results(bool json, const Json& objects, const std::string& key, std::string_view text);

/// The text of one such result.
void emit_result(std::string_view text);
/// From here on no texts about files that were written, and no progress.
void be_quiet();

/// From here on no lines of progress: a program reads the result.
void be_read_by_programs();

/// "btfield: warning: ..." on standard error.
void warn(const std::string& text);

/// From here on emit_text() writes to standard error: standard output is taken.
void report_to_standard_error();

/// NaN and infinity are null.
[[nodiscard]] Json number(double value);
/// [width, height].
[[nodiscard]] Json size_json(Size size);
/// Four significant digits; "-" for what is not a number.
[[nodiscard]] std::string number_text(double value);
[[nodiscard]] std::string seconds_text(double seconds);

class Stopwatch {
  public:
    [[nodiscard]] double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }

  private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// On standard error while work goes on: a bar where that is a terminal, gone at the end; else a line every
/// ten seconds, of commands that take so long, also where a part of the work takes longer. From any thread.
class Progress {
  public:
    /// Whether there are lines also where a program reads the result.
    enum class Lines { for_people, always };
    explicit Progress(Lines lines = Lines::for_people);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;
    /// \param fraction of the work that is done, 0 to 1
    /// \param line     without a terminal; empty: the share and `what`
    void show(double fraction, std::string_view what, std::string_view line = {});

  private:
    void repeat_lines();
    /// Where ten seconds have passed. Under the mutex.
    void put_line();

    bool terminal_, lines_;
    bool shown_ = false, ended_ = false;
    double last_line_ = 0.0;  ///< seconds
    std::string line_;        ///< empty: nothing to say yet
    Stopwatch watch_;
    std::mutex showing_;
    std::condition_variable ending_;
    std::thread repeating_;
};

/// While it lives, stages of the library (btfield/progress.hpp) that its thread asks for are parts of a bar.
class StagesShown {
  public:
    struct Part {
        std::string_view stage;
        double begin, end;  ///< shares
    };
    /// \param begin, share  of the bar, which the parts' shares are shares of
    /// \param of            stands before the stages' names
    /// \param parts         other stages leave the bar where it is
    StagesShown(Progress& bar, double begin, double share, std::string of, std::initializer_list<Part> parts);

  private:
    void show(std::string_view stage, double done);

    Progress& bar_;
    double begin_, share_;
    std::string of_;
    std::vector<Part> parts_;
    double shown_ = 0.0;  ///< of the parts: it never falls
    ProgressScope scope_;
};

}  // namespace btfield::cli
