#pragma once

// Work shared among the machine's cores such that the result does not depend on how many there are.

#include <algorithm>
#include <atomic>
#include <exception>
#include <thread>
#include <vector>

namespace btfield {

/// Calls work(block) once for every block in [0, blocks), on at most hardware_concurrency threads, the
/// caller's own included, in no particular order. Blocks write to places of their own, and whoever reduces
/// them does so in block order afterwards: that makes sums independent of the number of threads. The
/// exception of the lowest block that threw one is passed on, after all threads have ended.
template <class Work>
void for_each_block(int blocks, const Work& work) {
    if (blocks <= 0) return;
    const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    const int threads = std::min(cores, blocks);
    if (threads == 1) {
        for (int block = 0; block < blocks; ++block) work(block);
        return;
    }
    std::atomic<int> next{0};
    std::vector<std::exception_ptr> failures(static_cast<std::size_t>(blocks));
    const auto drain = [&] {
        for (int block = next++; block < blocks; block = next++) {
            try {
                work(block);
            } catch (...) {
                failures[static_cast<std::size_t>(block)] = std::current_exception();
            }
        }
    };
    {
        std::vector<std::jthread> helpers;
        helpers.reserve(static_cast<std::size_t>(threads - 1));
        for (int helper = 1; helper < threads; ++helper) helpers.emplace_back(drain);
        drain();
    }
    for (const std::exception_ptr& failure : failures) {
        if (failure) std::rethrow_exception(failure);
    }
}

}  // namespace btfield
