#include "btfield/progress.hpp"

#include <utility>

namespace btfield {
namespace {

thread_local const ProgressScope* innermost_progress = nullptr;

}  // namespace

ProgressScope::ProgressScope(std::function<void(std::string_view, double)> told)
    : told_(std::move(told)), outer_(std::exchange(innermost_progress, this)) {}
ProgressScope::~ProgressScope() {
    innermost_progress = outer_;
}

const ProgressScope* ProgressScope::current() {
    return innermost_progress;
}

void ProgressScope::tell(std::string_view stage, double share) const {
    if (told_) told_(stage, share);
}

}  // namespace btfield
