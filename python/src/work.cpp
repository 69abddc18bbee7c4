#include "python/src/work.hpp"

#include <atomic>
#include <chrono>
#include <string>
#include <thread>

#include "btfield/stop.hpp"

namespace btfield::python {

class Interruptible::State {
  public:
    State() : scope_([this] { return asked(); }) {}

    std::optional<nb::python_error> raised;

  private:
    using Clock = std::chrono::steady_clock;

    bool asked() {
        if (ended_) return true;
        if (std::this_thread::get_id() != thread_ || Clock::now() < next_) return false;
        {
            const nb::gil_scoped_acquire locked;
            if (PyErr_CheckSignals() != 0) {
                raised.emplace();
                ended_ = true;
            }
        }
        next_ = Clock::now() + std::chrono::milliseconds(50);
        return ended_;
    }

    std::atomic<bool> ended_ = false;
    const std::thread::id thread_ = std::this_thread::get_id();
    Clock::time_point next_ = Clock::now() + std::chrono::milliseconds(50);
    StopScope scope_;
};

Interruptible::Interruptible() : state_(std::make_unique<State>()) {}
Interruptible::~Interruptible() = default;

void Interruptible::rethrow() {
    if (!state_->raised) return;
    nb::python_error raised = std::move(*state_->raised);
    state_->raised.reset();
    throw raised;
}

std::function<void(double)> share_told(const nb::object& progress) {
    if (progress.is_none()) return {};
    return [told = progress.ptr()](double share) {
        const nb::gil_scoped_acquire locked;
        const nb::handle function(told);
        function(share);
    };
}

std::function<void(std::string_view, double)> stage_told(const nb::object& progress) {
    if (progress.is_none()) return {};
    return [told = progress.ptr()](std::string_view stage, double amount) {
        const nb::gil_scoped_acquire locked;
        const nb::handle function(told);
        function(nb::str(stage.data(), stage.size()), amount);
    };
}

}  // namespace btfield::python
