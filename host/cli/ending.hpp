#pragma once

/// \file
/// The end of the process by a signal: nothing half-made stays on disk.

#include <functional>

namespace btfield::cli {

/// From here on a thread waits for the signals that end a process by default, removes what is under
/// construction, and then ends the process by that signal. Signals that are ignored already, as nohup does,
/// stay ignored. Call first in main: threads that exist by then are not covered.
void watch_signals();

/// A crash, of a driver above all, becomes one line that names the likely remedy and exit code 3.
void explain_crashes();

/// While it lives, the first of SIGINT, SIGTERM and SIGUSR1 calls the function, in the thread that waits; the
/// second ends the process. One at a time.
class Interruption {
  public:
    explicit Interruption(std::function<void()> first);
    ~Interruption();
    Interruption(const Interruption&) = delete;
    Interruption& operator=(const Interruption&) = delete;
};

}  // namespace btfield::cli
