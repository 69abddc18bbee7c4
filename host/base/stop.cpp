#include "host/base/stop.hpp"

#include <utility>

#include "btfield/error.hpp"

namespace btfield {
namespace {

thread_local const StopScope* innermost_stop = nullptr;

}  // namespace

StopScope::StopScope(std::function<bool()> stop)
    : stop_(std::move(stop)), outer_(std::exchange(innermost_stop, this)) {}
StopScope::~StopScope() {
    innermost_stop = outer_;
}

bool StopScope::asked() const {
    return (stop_ && stop_()) || (outer_ != nullptr && outer_->asked());
}

namespace detail {

const StopScope* current_stop() {
    return innermost_stop;
}

InheritedStop::InheritedStop(const StopScope* of) : before_(std::exchange(innermost_stop, of)) {}
InheritedStop::~InheritedStop() {
    innermost_stop = before_;
}

void stop_if_asked() {
    if (innermost_stop != nullptr && innermost_stop->asked())
        throw Stopped("go on with the work", "a StopScope of the caller's ends it",
                      "ask again to begin anew");
}

}  // namespace detail
}  // namespace btfield
