#pragma once

// How long work learns that its caller wants no more of it (btfield/stop.hpp).

#include "btfield/stop.hpp"

namespace btfield::detail {

/// The innermost scope of this thread; null without one.
[[nodiscard]] const StopScope* current_stop();

/// The scope of the thread that opened a loop, in one that helps with it.
class InheritedStop {
  public:
    explicit InheritedStop(const StopScope* of);
    ~InheritedStop();
    InheritedStop(const InheritedStop&) = delete;
    InheritedStop& operator=(const InheritedStop&) = delete;

  private:
    const StopScope* before_;
};

/// \throws Stopped when a scope of this thread says so
void stop_if_asked();

}  // namespace btfield::detail
