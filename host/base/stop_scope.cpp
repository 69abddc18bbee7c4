#include "btfield/stop.hpp"

#include <utility>

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

const StopScope* StopScope::current() {
    return innermost_stop;
}

}  // namespace btfield
