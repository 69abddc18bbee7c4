#pragma once

// How long work learns that its caller wants no more of it (btfield/stop.hpp).

#include "btfield/stop.hpp"

namespace btfield::detail {

/// Makes this thread ask a scope of the thread that it works for, which outlives it; null: none.
class InheritedStop {
  public:
    explicit InheritedStop(const StopScope* of);

  private:
    StopScope scope_;
};

/// \throws Stopped when a scope of this thread says so
void stop_if_asked();

}  // namespace btfield::detail
