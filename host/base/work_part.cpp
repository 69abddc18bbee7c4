#include "host/base/work_part.hpp"

#include <algorithm>
#include <utility>

#include "host/base/stop.hpp"

namespace btfield::detail {
namespace {

thread_local WorkPart* innermost_part = nullptr;

}  // namespace

WorkPart::WorkPart(double share, Stage* whole) : outer_(current_part()), share_(share), whole_(whole) {
    if (whole_ == nullptr && outer_ != nullptr) whole_ = outer_->whole_;
    if (whole_ != nullptr) exchange_part(this);
}

WorkPart::~WorkPart() {
    if (whole_ == nullptr) return;
    exchange_part(outer_);
    const std::lock_guard lock(whole_->counting_);
    count(1.0);
}

void WorkPart::done(double share) {
    stop_if_asked();
    if (whole_ == nullptr) return;
    const std::lock_guard lock(whole_->counting_);
    count(share - counted_);
    whole_->tell(whole_->all_.counted_);
}

void WorkPart::nearer(double portion) {
    stop_if_asked();
    if (whole_ == nullptr) return;
    const std::lock_guard lock(whole_->counting_);
    count(portion * (1.0 - counted_));
    whole_->tell(whole_->all_.counted_);
}

double WorkPart::counted() const {
    if (whole_ == nullptr) return 0.0;
    const std::lock_guard lock(whole_->counting_);
    return counted_;
}

void WorkPart::count(double more) {
    for (WorkPart* part = this; part != nullptr; part = part->outer_) {
        more = std::clamp(more, 0.0, 1.0 - part->counted_);
        part->counted_ += more;
        more *= part->share_;
    }
}

Stage::Stage(std::string_view name)
    : name_(name),
      scope_(current_part() == nullptr ? ProgressScope::current() : nullptr),
      all_(1.0, scope_ != nullptr ? this : nullptr) {
    stop_if_asked();
    if (scope_ == nullptr) return;
    const std::lock_guard lock(counting_);
    scope_->tell(name_, 0.0);
}

void Stage::tell(double share) {
    constexpr double least = 0.002;
    if (share < told_ + least) return;
    told_ = share;
    scope_->tell(name_, share);
}

void work_done(double share) {
    if (WorkPart* const part = current_part())
        part->done(share);
    else
        stop_if_asked();
}

void work_nearer(double portion) {
    if (WorkPart* const part = current_part())
        part->nearer(portion);
    else
        stop_if_asked();
}

double work_counted() {
    const WorkPart* const part = current_part();
    return part == nullptr ? 0.0 : part->counted();
}

WorkPart* current_part() {
    return innermost_part;
}

WorkPart* exchange_part(WorkPart* part) {
    return std::exchange(innermost_part, part);
}

InheritedPart::InheritedPart(WorkPart* of) : before_(exchange_part(of)) {}
InheritedPart::~InheritedPart() {
    exchange_part(before_);
}

}  // namespace btfield::detail
