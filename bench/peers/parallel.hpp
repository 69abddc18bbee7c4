#pragma once

#include <thread>
#include <vector>

namespace btfield::peer {

/// Threads that every peer uses: the two cores of the reference machine.
inline constexpr int threads = 2;

/// Calls work(thread) on each thread and waits. Starting a thread costs some 20 µs.
template <typename Work>
void parallel(const Work& work) {
    std::vector<std::jthread> others;
    for (int t = 1; t < threads; ++t) others.emplace_back([&work, t] { work(t); });
    work(0);
}

/// First index of part t when n items are shared out; part t ends where part t + 1 begins.
constexpr int share(int n, int t) {
    return static_cast<int>(static_cast<long>(n) * t / threads);
}

}  // namespace btfield::peer
