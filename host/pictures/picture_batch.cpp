#include "btfield/picture_batch.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <exception>
#include <mutex>
#include <utility>
#include <vector>

#include "host/base/file_output.hpp"
#include "host/pictures/encoded_picture.hpp"

namespace btfield {

using namespace detail;

namespace {

constexpr std::chrono::seconds shortest_pause{1};  // between two groups that are not full

/// Of open files; few where the process may have few, of which others are in use.
std::size_t largest_group() {
    constexpr std::size_t usual = 64, in_use = 48;
    rlimit limit{};
    if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return usual;
    const auto open = static_cast<std::size_t>(limit.rlim_cur);
    return std::clamp<std::size_t>(open > in_use ? (open - in_use) / 4 : 1, 1, usual);
}

}  // namespace

class [[gnu::visibility("hidden")]] PictureBatch::Impl {
  public:
    void add(std::unique_ptr<FileOutput> file) {
        if (file->special()) return file->commit();
        file->begin_flush();
        Group full;
        {
            const std::lock_guard lock(mutex_);
            const auto now = Clock::now();
            waiting_.push_back(std::move(file));
            if (waiting_.size() < largest_ && now - settled_ < shortest_pause) return;
            full.swap(waiting_);
            settled_ = now;
        }
        settle(full);
    }
    void settle() {
        Group rest;
        {
            const std::lock_guard lock(mutex_);
            rest.swap(waiting_);
        }
        settle(rest);
    }

  private:
    using Group = std::vector<std::unique_ptr<FileOutput>>;
    using Clock = std::chrono::steady_clock;

    /// The disk has begun with all of them, and file systems with a journal have one entry for all: the first
    /// wait is that of the group. Those that reach the disk get their names, whatever happens to others.
    static void settle(Group & group) {
        std::exception_ptr failure;
        for (auto& file : group) {
            try {
                file->flush();
            } catch (...) {
                if (!failure) failure = std::current_exception();
                file.reset();
            }
        }
        for (auto& file : group) {
            try {
                if (file) file->commit(false);
            } catch (...) {
                if (!failure) failure = std::current_exception();
            }
        }
        group.clear();
        if (failure) std::rethrow_exception(failure);
    }

    std::mutex mutex_;  ///< of what follows
    Group waiting_;
    std::size_t largest_ = largest_group();
    Clock::time_point settled_ = Clock::now();
};

PictureBatch::PictureBatch() : impl_(std::make_unique<Impl>()) {}
PictureBatch::~PictureBatch() {
    try {
        finish();
    } catch (...) {
        // finish() is there for those who want to know.
    }
}

WriteReport PictureBatch::write(const std::filesystem::path& path, const Image& image,
                                const WriteOptions& options) {
    EncodedPicture encoded = encode(path, image, options);
    impl_->add(std::move(encoded.file));
    return std::move(encoded.report);
}

void PictureBatch::finish() {
    impl_->settle();
}

}  // namespace btfield
