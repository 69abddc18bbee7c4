#include "btfield/threads.hpp"

#include <algorithm>
#include <atomic>
#include <string>
#include <thread>

#include "btfield/error.hpp"
#include "host/base/limits.hpp"

namespace btfield {
namespace {

/// 0: none was set.
std::atomic<int> limit{0};

}  // namespace

int thread_limit() {
    const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    int threads = limit.load(std::memory_order_relaxed);
    if (threads == 0) {
        static const int environment = detail::threads_of_environment();
        threads = environment;
    }
    return threads == 0 ? cores : std::min(threads, cores);
}

void limit_threads(int count) {
    if (count < 0)
        throw InputError("use " + std::to_string(count) + " threads", "there is at least one",
                         "give 1 or more, or 0 for as many as there are cores");
    limit.store(count, std::memory_order_relaxed);
}

}  // namespace btfield
