#include "host/base/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include "btfield/threads.hpp"
#include "host/base/stop.hpp"
#include "host/base/work_part.hpp"

namespace btfield::detail {
namespace {

/// One call of for_each_block().
struct Loop {
    Loop(int count, BlockWork of) : blocks(count), work(of) {}
    int blocks;
    BlockWork work;
    const StopScope* stop = StopScope::current();
    WorkPart* part = current_part();
    std::atomic<int> next{0};
    int helpers = 0;  ///< under the crew's mutex
    std::mutex failing;
    int failed_block = 0;
    std::exception_ptr failure;

    [[nodiscard]] bool has_blocks() const { return next.load(std::memory_order_relaxed) < blocks; }
    void drain() {
        for (int block = next++; block < blocks; block = next++) {
            try {
                stop_if_asked();
                work.call(work.work, block);
            } catch (...) {
                const std::lock_guard lock(failing);
                if (!failure || block < failed_block) {
                    failure = std::current_exception();
                    failed_block = block;
                }
            }
        }
    }
};

/// Threads that wait for loops: starting one for each loop takes longer than most loops do.
class Crew {
  public:
    /// Never taken down: a process may end, or a forked one go on, while its threads wait.
    static Crew& of_process() {
        static Crew& crew = *new Crew;
        return crew;
    }
    [[nodiscard]] int helpers() const { return helpers_; }

    /// \param threads that may work, the caller's included
    void run(Loop& loop, int threads) {
        {
            const std::lock_guard lock(mutex_);
            most_working_ = threads - 1;
            open_.push_back(&loop);
        }
        for (int k = 0; k < std::min(threads - 1, loop.blocks - 1); ++k) opened_.notify_one();
        loop.drain();
        std::unique_lock lock(mutex_);
        std::erase(open_, &loop);
        left_.wait(lock, [&] { return loop.helpers == 0; });
    }

  private:
    Crew() {
        const auto cores = static_cast<int>(std::thread::hardware_concurrency());
        try {
            for (; helpers_ < cores - 1; ++helpers_) std::thread([this] { help(); }).detach();
        } catch (const std::system_error&) {
            // As many as the system grants.
        }
    }

    [[noreturn]] void help() {
        std::unique_lock lock(mutex_);
        for (;;) {
            Loop* loop = nullptr;
            opened_.wait(lock, [&] { return working_ < most_working_ && (loop = outermost()) != nullptr; });
            ++working_;
            ++loop->helpers;
            lock.unlock();
            {
                const InheritedStop inherited(loop->stop);
                const InheritedPart in_part(loop->part);
                loop->drain();
            }
            lock.lock();
            --working_;
            if (--loop->helpers == 0) left_.notify_all();
        }
    }
    [[nodiscard]] Loop* outermost() const {
        const auto found =
            std::find_if(open_.begin(), open_.end(), [](const Loop* loop) { return loop->has_blocks(); });
        return found == open_.end() ? nullptr : *found;
    }

    int helpers_ = 0;
    std::mutex mutex_;  ///< of what follows
    int working_ = 0, most_working_ = 0;
    std::condition_variable opened_, left_;
    std::vector<Loop*> open_;
};

}  // namespace

void run_blocks(int blocks, BlockWork work) {
    if (blocks <= 0) return;
    const int threads = blocks == 1 ? 1 : std::min(thread_limit(), 1 + Crew::of_process().helpers());
    if (threads < 2) {
        for (int block = 0; block < blocks; ++block) {
            stop_if_asked();
            work.call(work.work, block);
        }
        return;
    }
    Loop loop(blocks, work);
    Crew::of_process().run(loop, threads);
    if (loop.failure) std::rethrow_exception(loop.failure);
}

}  // namespace btfield::detail
