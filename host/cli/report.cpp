#include "host/cli/report.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <system_error>
#include <utility>

#include "btfield/error.hpp"

namespace btfield::cli {
namespace {

bool quiet = false, read_by_programs = false;  // set before any work begins
std::FILE* report_stream = stdout;

template <typename... Arguments>
std::string formatted(const char* format, Arguments... arguments) {
    std::array<char, 64> buffer{};
    const int length = std::snprintf(buffer.data(), buffer.size(), format, arguments...);
    return {buffer.data(), static_cast<std::size_t>(std::clamp(length, 0, 63))};
}

constexpr double line_interval = 10.0;  // seconds

}  // namespace

void report_to_standard_error() {
    report_stream = stderr;
}

void emit_text(std::string_view text) {
    errno = 0;
    const bool written = std::fwrite(text.data(), 1, text.size(), report_stream) == text.size() &&
                         std::fflush(report_stream) == 0;
    if (!written) {
        throw InputError("print the result", "standard output: " + std::generic_category().message(errno),
                         "give the command an output that stays open");
    }
}

void emit_json(const Json& object) {
    emit_text(object.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n");
}

void emit_answers(bool json, const Json& objects, const std::string& key, std::string_view text) {
    if (!json)
        emit_text(text);
    else
        emit_json(objects.size() == 1 ? objects.front() : Json{{key, objects}});
}

void be_quiet() {
    quiet = true;
}

void be_read_by_programs() {
    read_by_programs = true;
}

void emit_result(std::string_view text) {
    if (!quiet) emit_text(text);
}

void emit_results(bool json, const Json& objects, const std::string& key, std::string_view text) {
    if (json || !quiet) emit_answers(json, objects, key, text);
}

void warn(const std::string& text) {
    const char* const clear_bar = ::isatty(STDERR_FILENO) == 1 ? "\r\x1b[K" : "";
    std::fprintf(stderr, "%sbtfield: warning: %s\n", clear_bar, text.c_str());
}

Json number(double value) {
    return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json size_json(Size size) {
    return Json::array({size.width, size.height});
}

std::string number_text(double value) {
    return std::isfinite(value) ? formatted("%.4g", value) : "-";
}

std::string seconds_text(double seconds) {
    return formatted("%.3f s", seconds);
}

Progress::Progress(Lines lines)
    : terminal_(!quiet && ::isatty(STDERR_FILENO) == 1),
      lines_(!quiet && !terminal_ && (lines == Lines::always || !read_by_programs)) {
    if (!lines_) return;
    try {
        repeating_ = std::thread([this] { repeat_lines(); });
    } catch (const std::system_error&) {
        // No thread to be had: lines come as parts of the work end.
    }
}

Progress::~Progress() {
    {
        const std::lock_guard lock(showing_);
        ended_ = true;
    }
    ending_.notify_all();
    if (repeating_.joinable()) repeating_.join();
    if (shown_) std::fputs("\r\x1b[K", stderr);
}

void Progress::put_line() {
    const double now = watch_.seconds();
    if (line_.empty() || now - last_line_ < line_interval) return;
    last_line_ = now;
    std::fputs((line_ + "\n").c_str(), stderr);
}

void Progress::repeat_lines() {
    std::unique_lock lock(showing_);
    while (!ended_) {
        const double left = std::max(0.0, last_line_ + line_interval - watch_.seconds());
        ending_.wait_for(lock, std::chrono::duration<double>(left + 0.01));
        if (!ended_) put_line();
    }
}

void Progress::show(double fraction, std::string_view what, std::string_view line) {
    if (!terminal_ && !lines_) return;
    const double share = std::clamp(fraction, 0.0, 1.0);
    const std::lock_guard lock(showing_);
    if (lines_) {
        line_ = line.empty() ? formatted("%.0f %%: ", std::floor(100.0 * share)) + std::string(what)
                             : std::string(line);
        put_line();
        return;
    }
    constexpr int width = 30;
    const int full = static_cast<int>(share * width);
    const std::string bar(static_cast<std::size_t>(full), '#');
    const int shown = static_cast<int>(std::min<std::size_t>(what.size(), 40));
    std::fprintf(stderr, "\r\x1b[K[%-*s] %.*s", width, bar.c_str(), shown, what.data());
    std::fflush(stderr);
    shown_ = true;
}

StagesShown::StagesShown(Progress& bar, double begin, double share, std::string of,
                         std::initializer_list<Part> parts)
    : bar_(bar),
      begin_(begin),
      share_(share),
      of_(std::move(of)),
      parts_(parts),
      scope_([this](std::string_view stage, double done) { show(stage, done); }) {}

void StagesShown::show(std::string_view stage, double done) {
    for (const Part& part : parts_)
        if (part.stage == stage) shown_ = std::max(shown_, part.begin + done * (part.end - part.begin));
    bar_.show(begin_ + share_ * shown_, of_ + std::string(stage));
}

}  // namespace btfield::cli
