#include "host/cl/buffer_pool.hpp"

#include <algorithm>
#include <map>
#include <mutex>
#include <new>

#include "host/base/huge_pages.hpp"
#include "host/cl/api.hpp"

namespace btfield::detail {

struct Buffer::Shelf {
    explicit Shelf(const cl::Context& of) : context(of) {}
    cl::Context context;
    std::mutex mutex;  ///< of what follows
    std::multimap<std::size_t, std::shared_ptr<cl::Buffer>> idle;
    std::shared_ptr<HugeMemory> shared;  ///< huge page from which small buffers are cut

    [[nodiscard]] std::shared_ptr<HugeMemory> page_for(std::size_t bytes, std::byte*& place) {
        const std::lock_guard lock(mutex);
        if (shared && (place = shared->take(bytes)) != nullptr) return shared;
        auto fresh = std::make_shared<HugeMemory>(huge_page);
        place = fresh->take(bytes);
        if (!shared || fresh->left() > shared->left()) shared = fresh;
        return fresh;
    }
};

Buffer& Buffer::operator=(Buffer&& other) noexcept {
    if (this != &other) {
        release();
        shelf_ = std::move(other.shelf_);
        handle_ = std::move(other.handle_);
        bytes_ = std::exchange(other.bytes_, 0);
        capacity_ = std::exchange(other.capacity_, 0);
    }
    return *this;
}

void Buffer::release() noexcept {
    if (shelf_) {
        try {
            const std::lock_guard lock(shelf_->mutex);
            shelf_->idle.emplace(capacity_, handle_);
        } catch (const std::bad_alloc&) {
            // The handle's own destructor frees the memory.
        }
    }
    shelf_.reset();
    handle_.reset();
    bytes_ = capacity_ = 0;
}

Buffer Buffer::foreign(std::shared_ptr<cl::Buffer> handle, std::size_t bytes) {
    Buffer buffer;
    buffer.handle_ = std::move(handle);
    buffer.bytes_ = buffer.capacity_ = bytes;
    return buffer;
}

namespace {

/// Bytes of a buffer that is worth a place in a huge page: fresh pages of the usual size cost more than what
/// is computed there.
constexpr std::size_t smallest_mapped = std::size_t{1} << 16;

void CL_CALLBACK unmap(cl_mem /*gone*/, void* mapping) {
    const std::unique_ptr<std::shared_ptr<HugeMemory>> done(
        static_cast<std::shared_ptr<HugeMemory>*>(mapping));
}

/// A buffer in memory of the host's, which it keeps until the last command that uses the buffer.
std::shared_ptr<cl::Buffer> mapped_buffer(const cl::Context& context, std::size_t bytes, std::byte* place,
                                          std::shared_ptr<HugeMemory> mapping) {
    auto kept = std::make_unique<std::shared_ptr<HugeMemory>>(std::move(mapping));
    auto buffer =
        std::make_shared<cl::Buffer>(context, CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, bytes, place);
    buffer->setDestructorCallback(&unmap, kept.get());
    static_cast<void>(kept.release());  // unmap() has it now
    return buffer;
}

}  // namespace

BufferPool::BufferPool(const cl::Context& context, std::string device_name, std::size_t largest_allocation,
                       bool shares_memory)
    : device_name_(std::move(device_name)),
      largest_(largest_allocation),
      shares_memory_(shares_memory),
      shelf_(std::make_shared<Buffer::Shelf>(context)) {}

Buffer BufferPool::take(std::size_t bytes) {
    bytes = std::max<std::size_t>(bytes, 4);
    Buffer buffer;
    {
        const std::lock_guard lock(shelf_->mutex);
        const auto found = shelf_->idle.lower_bound(bytes);
        // A loan of much more than was asked for would starve the next large one.
        if (found != shelf_->idle.end() && found->first <= bytes + bytes / 4 + 4096) {
            buffer.handle_ = std::move(found->second);
            buffer.capacity_ = found->first;
            shelf_->idle.erase(found);
        }
    }
    if (!buffer.handle_) {
        if (bytes > largest_)
            throw DeviceError("allocate " + std::to_string(bytes) + " bytes on device '" + device_name_ + "'",
                              "its largest allocation is " + std::to_string(largest_) + " bytes",
                              "use a smaller size, or a device with more memory");
        const auto allocate = [&] {
            if (!shares_memory_ || bytes < smallest_mapped)
                return std::make_shared<cl::Buffer>(shelf_->context, CL_MEM_READ_WRITE, bytes);
            std::byte* place = nullptr;
            std::shared_ptr<HugeMemory> mapping;
            if (bytes < huge_page) {
                mapping = shelf_->page_for(bytes, place);
            } else {
                mapping = std::make_shared<HugeMemory>(bytes);
                place = mapping->take(bytes);
            }
            return mapped_buffer(shelf_->context, bytes, place, std::move(mapping));
        };
        try {
            buffer.handle_ = allocate();
        } catch (const cl::Error&) {
            clear();
        } catch (const std::bad_alloc&) {
            clear();
        }
        if (!buffer.handle_)
            buffer.handle_ = guarded("allocate " + std::to_string(bytes) + " bytes", device_name_, allocate);
        buffer.capacity_ = bytes;
    }
    buffer.bytes_ = bytes;
    buffer.shelf_ = shelf_;
    return buffer;
}

std::size_t BufferPool::idle_bytes() const {
    const std::lock_guard lock(shelf_->mutex);
    std::size_t sum = 0;
    for (const auto& [bytes, handle] : shelf_->idle) sum += bytes;
    return sum;
}

void BufferPool::clear() {
    const std::lock_guard lock(shelf_->mutex);
    shelf_->idle.clear();
    shelf_->shared.reset();
}

}  // namespace btfield::detail
