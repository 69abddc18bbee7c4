#pragma once

// Work of the library for Python: without the interpreter's lock, ended by Ctrl-C, with progress told.

#include <nanobind/nanobind.h>

#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

#include "btfield/error.hpp"

namespace nb = nanobind;

namespace btfield::python {

/// The interpreter's lock let go.
class Unlocked {
    nb::gil_scoped_release release_;
};

/// Asks for signals now and then, in the thread that runs handlers of them; ends the work when one raises.
class Interruptible {
  public:
    Interruptible();
    ~Interruptible();
    Interruptible(const Interruptible&) = delete;
    Interruptible& operator=(const Interruptible&) = delete;
    /// Throws what a handler raised; returns where none did.
    void rethrow();

  private:
    class State;
    std::unique_ptr<State> state_;
};

/// work() without the lock. What handlers of signals raise, KeyboardInterrupt above all, ends the work and is
/// thrown.
template <class Work>
auto unlocked(Work&& work) {
    Interruptible interruptible;
    const auto run = [&] {
        const Unlocked unlocked;
        return work();
    };
    try {
        if constexpr (std::is_void_v<decltype(run())>) {
            run();
            interruptible.rethrow();
        } else {
            auto result = run();
            interruptible.rethrow();
            return result;
        }
    } catch (const Stopped&) {
        interruptible.rethrow();
        throw;
    }
}

/// Calls of a Python function from the library, in whatever thread; none where the object is None.
[[nodiscard]] std::function<void(double)> share_told(const nb::object& progress);
[[nodiscard]] std::function<void(std::string_view, double)> stage_told(const nb::object& progress);

/// What is destroyed without the lock: it may wait for the device, whose user may wait for the lock.
template <class Value>
class Held {
  public:
    template <class Make>
    requires std::is_invocable_r_v<Value, Make>
    explicit Held(Make&& make) : value_(make()) {}
    Held(const Held&) = delete;
    Held& operator=(const Held&) = delete;
    ~Held() {
        if (PyGILState_Check() != 0) {
            const Unlocked unlocked;
            value_.reset();
        }
    }
    Value& operator*() { return *value_; }
    Value* operator->() { return &*value_; }
    const Value* operator->() const { return &*value_; }

  private:
    std::optional<Value> value_;
};

}  // namespace btfield::python
