#include "host/cli/texture_writer.hpp"

#include <algorithm>
#include <system_error>

namespace btfield::cli {

TextureWriter::TextureWriter(Work work, int threads, std::size_t room)
    : work_(std::move(work)), room_(std::max<std::size_t>(1, room)) {
    try {
        for (int k = 0; k < threads; ++k) threads_.emplace_back([this] { serve(); });
    } catch (const std::system_error&) {
        // As many as the system grants.
    }
}

TextureWriter::~TextureWriter() {
    end();
}

void TextureWriter::put(std::size_t number, Image texture) {
    if (threads_.empty()) return work_(number, texture);
    std::unique_lock lock(mutex_);
    taken_.wait(lock, [&] { return waiting_.size() < room_ || failure_; });
    if (failure_) std::rethrow_exception(failure_);
    waiting_.emplace_back(number, std::move(texture));
    filled_.notify_one();
}

void TextureWriter::finish() {
    end();
    if (failure_) std::rethrow_exception(failure_);
}

void TextureWriter::serve() {
    std::unique_lock lock(mutex_);
    for (;;) {
        filled_.wait(lock, [&] { return !waiting_.empty() || closed_; });
        if (waiting_.empty()) return;
        {
            const auto [number, texture] = std::move(waiting_.front());
            waiting_.pop_front();
            taken_.notify_one();
            lock.unlock();
            try {
                work_(number, texture);
            } catch (...) {
                const std::lock_guard again(mutex_);
                if (!failure_) failure_ = std::current_exception();
            }
        }
        lock.lock();
        if (failure_) {
            waiting_.clear();
            taken_.notify_all();
        }
    }
}

void TextureWriter::end() {
    {
        const std::lock_guard lock(mutex_);
        closed_ = true;
    }
    filled_.notify_all();
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
}

}  // namespace btfield::cli
