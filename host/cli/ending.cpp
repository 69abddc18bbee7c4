#include "host/cli/ending.hpp"

#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "host/base/temporary_names.hpp"
#include "host/cl/pocl_cache.hpp"

namespace btfield::cli {
namespace {

/// What the thread that waits for signals shares with others; never destroyed, as that thread outlives all.
struct Watch {
    std::mutex changing;
    std::function<void()> first;
};

Watch& watch() {
    static Watch& only = *new Watch;
    return only;
}

/// Whether the signal ends a process that does nothing about it. Without those that report a defect of the
/// running instruction: they cannot wait.
bool ends_a_process(int signal) {
    constexpr std::array others{SIGKILL,  SIGSTOP, SIGCHLD, SIGCONT, SIGTSTP, SIGTTIN, SIGTTOU, SIGURG,
                                SIGWINCH, SIGSEGV, SIGBUS,  SIGFPE,  SIGILL,  SIGTRAP, SIGSYS};
    return std::find(others.begin(), others.end(), signal) == others.end();
}

sigset_t signals_that_end() {
    sigset_t set;
    sigemptyset(&set);
    for (int signal = 1; signal <= SIGRTMAX; ++signal) {
        if (signal > SIGSYS && signal < SIGRTMIN) continue;  // the C library's own
        struct sigaction now {};
        if (::sigaction(signal, nullptr, &now) != 0 || now.sa_handler != SIG_DFL) continue;
        if (ends_a_process(signal)) sigaddset(&set, signal);
    }
    return set;
}

/// Whether somebody else takes care of it.
bool taken(int signal) {
    if (signal != SIGINT && signal != SIGTERM && signal != SIGUSR1) return false;
    Watch& shared = watch();
    const std::lock_guard lock(shared.changing);
    const std::function<void()> first = std::exchange(shared.first, nullptr);
    if (first) first();
    return first != nullptr;
}

void wait_for(const sigset_t& set) {
    for (;;) {
        int signal = 0;
        if (::sigwait(&set, &signal) != 0 || taken(signal)) continue;
        detail::remove_temporaries();
        std::signal(signal, SIG_DFL);  // a driver may have put a handler of its own there
        sigset_t one;
        sigemptyset(&one);
        sigaddset(&one, signal);
        ::pthread_sigmask(SIG_UNBLOCK, &one, nullptr);
        ::raise(signal);  // never returns
    }
}

/// Made beforehand: a handler must not take memory.
std::string& crash_line() {
    static std::string& only = *new std::string;
    return only;
}

void tell_of_crash(int /*signal*/) {
    constexpr int device_failed = 3;
    const std::string& line = crash_line();
    if (::write(STDERR_FILENO, line.data(), line.size()) < 0) ::_exit(device_failed);
    ::_exit(device_failed);
}

}  // namespace

void explain_crashes() {
    crash_line() =
        "btfield: finish the command: the OpenCL driver, or btfield itself, crashed; if the driver is PoCL, "
        "its "
        "cache may be damaged or full: remove '" +
        detail::pocl_cache_folder().string() + "' and try again, else report this as a defect\n";
    for (const int signal : {SIGABRT, SIGBUS, SIGSEGV, SIGILL}) {
        struct sigaction now {};
        // A sanitizer or debugger that is interested already keeps the signal.
        if (::sigaction(signal, nullptr, &now) == 0 && now.sa_handler == SIG_DFL)
            std::signal(signal, &tell_of_crash);
    }
}

void watch_signals() {
    const sigset_t set = signals_that_end();
    ::pthread_sigmask(SIG_BLOCK, &set, nullptr);  // of all threads to come
    try {
        std::thread(wait_for, set).detach();
    } catch (const std::system_error&) {
        ::pthread_sigmask(SIG_UNBLOCK, &set,
                          nullptr);  // no thread to be had: signals end the process as ever
    }
}

Interruption::Interruption(std::function<void()> first) {
    const std::lock_guard lock(watch().changing);
    watch().first = std::move(first);
}

Interruption::~Interruption() {
    const std::lock_guard lock(watch().changing);
    watch().first = nullptr;
}

}  // namespace btfield::cli
