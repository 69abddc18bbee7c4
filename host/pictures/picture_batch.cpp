#include "btfield/picture_batch.hpp"

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

constexpr std::size_t largest_group = 64;          // of open files, of which a process has 1024
constexpr std::chrono::seconds shortest_pause{1};  // between two groups that are not full

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
            if (waiting_.size() < largest_group && now - settled_ < shortest_pause) return;
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
