#pragma once

/// \file
/// Textures of a batch on their way to files, while the device grows the next ones.

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "btfield/image.hpp"

namespace btfield::cli {

/// Threads that write textures in any order. As many textures wait as are given room for, so that a batch
/// takes the same memory however long it is.
class TextureWriter {
  public:
    using Work = std::function<void(std::size_t number, const Image& texture)>;

    /// \param threads  that work; with none, put() does the work itself
    /// \param room  for textures that wait; at least 1
    TextureWriter(Work work, int threads, std::size_t room);
    /// Writes what waits; silent about what fails.
    ~TextureWriter();
    TextureWriter(const TextureWriter&) = delete;
    TextureWriter& operator=(const TextureWriter&) = delete;

    /// Waits until there is room.
    /// \throws what the work threw for an earlier texture, or for this one
    void put(std::size_t number, Image texture);
    /// Waits until all is written.
    /// \throws what the work threw first
    void finish();

  private:
    void serve();
    void end();

    Work work_;
    std::size_t room_;
    std::mutex mutex_;  ///< of what follows but the threads
    std::condition_variable filled_, taken_;
    std::deque<std::pair<std::size_t, Image>> waiting_;
    std::exception_ptr failure_;
    bool closed_ = false;
    std::vector<std::thread> threads_;
};

}  // namespace btfield::cli
