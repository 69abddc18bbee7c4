#pragma once

/// \file
/// Device memory that is handed back instead of freed, from any thread. What was enqueued with it may still
/// be waiting: queues are in order, so whatever borrows the memory next is enqueued, and runs, after that.

#include <cstddef>
#include <memory>
#include <string>
#include <utility>

namespace cl {
class Buffer;
class Context;
}  // namespace cl

namespace btfield::detail {

class BufferPool;

/// Device memory on loan from a pool; returned on destruction. Move only. May outlive the pool's owner.
class Buffer {
  public:
    Buffer() = default;
    Buffer(Buffer&& other) noexcept { *this = std::move(other); }
    Buffer& operator=(Buffer&& other) noexcept;
    ~Buffer() { release(); }

    /// Null without memory.
    [[nodiscard]] const cl::Buffer* handle() const { return handle_.get(); }
    /// Bytes asked for; the memory behind may be larger.
    [[nodiscard]] std::size_t bytes() const { return bytes_; }
    [[nodiscard]] explicit operator bool() const { return bytes_ != 0; }
    /// Memory that belongs to no pool: the handle keeps it.
    [[nodiscard]] static Buffer foreign(std::shared_ptr<cl::Buffer> handle, std::size_t bytes);

  private:
    friend class BufferPool;
    struct Shelf;
    void release() noexcept;

    std::shared_ptr<Shelf> shelf_;
    std::shared_ptr<cl::Buffer> handle_;
    std::size_t bytes_ = 0;
    std::size_t capacity_ = 0;
};

class BufferPool {
  public:
    /// \param shares_memory  of the host: the device works in memory that the pool maps, in huge pages where
    ///     it is large, and mapping a buffer copies nothing
    BufferPool(const cl::Context& context, std::string device_name, std::size_t largest_allocation,
               bool shares_memory = false);

    /// Uninitialised read-write memory of at least `bytes`.
    /// \throws DeviceError when the device refuses, after unused buffers were freed.
    [[nodiscard]] Buffer take(std::size_t bytes);
    /// Bytes held by the pool and not on loan.
    [[nodiscard]] std::size_t idle_bytes() const;
    void clear();

  private:
    std::string device_name_;
    std::size_t largest_;
    bool shares_memory_;
    std::shared_ptr<Buffer::Shelf> shelf_;
};

}  // namespace btfield::detail
