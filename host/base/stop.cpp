#include "host/base/stop.hpp"

#include "btfield/error.hpp"

namespace btfield::detail {

InheritedStop::InheritedStop(const StopScope* of) : scope_([of] { return of != nullptr && of->asked(); }) {}

void stop_if_asked() {
    const StopScope* const stop = StopScope::current();
    if (stop != nullptr && stop->asked())
        throw Stopped("go on with the work", "a StopScope of the caller's ends it",
                      "ask again to begin anew");
}

}  // namespace btfield::detail
