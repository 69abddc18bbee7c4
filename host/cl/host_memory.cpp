#include "host/cl/host_memory.hpp"

#include <cstdint>
#include <string>
#include <utility>

#include "host/base/huge_pages.hpp"
#include "host/cl/api.hpp"

namespace btfield::detail {

struct HostMemory::OpenCl {
    DeviceImpl* device;
    std::span<float> memory;
    std::shared_ptr<cl::Buffer> buffer;
    cl::Event shown;  ///< none before show()

    [[nodiscard]] const std::string& name() const { return device->info().name; }
};

bool HostMemory::suits(const DeviceImpl& device, std::span<const float> memory) {
    return device.shares_memory() && memory.size_bytes() >= huge_page &&
           memory.size_bytes() <= device.largest_allocation() &&
           reinterpret_cast<std::uintptr_t>(memory.data()) % huge_page == 0;
}

HostMemory::HostMemory(DeviceImpl& device, std::span<float> memory)
    : opencl_(std::make_unique<OpenCl>(OpenCl{&device, memory, {}, {}})) {
    opencl_->buffer = guarded("use memory of the host's", device.info().name, [&] {
        return std::make_shared<cl::Buffer>(device.context(), CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR,
                                            memory.size_bytes(), memory.data());
    });
}
HostMemory::HostMemory(HostMemory&&) noexcept = default;
HostMemory& HostMemory::operator=(HostMemory&& other) noexcept {
    HostMemory before(std::move(*this));
    opencl_ = std::move(other.opencl_);
    return *this;
}

HostMemory::~HostMemory() {
    if (!opencl_) return;
    try {
        if (opencl_->shown())
            opencl_->shown.wait();
        else
            opencl_->device->queue().finish();
    } catch (const cl::Error&) {
        // Nothing is left to report to.
    }
}

Buffer HostMemory::buffer() const {
    return Buffer::foreign(opencl_->buffer, opencl_->memory.size_bytes());
}

void HostMemory::show() {
    guarded("map memory of the host's", opencl_->name(), [&] {
        const cl::CommandQueue& queue = opencl_->device->queue();
        // What a driver keeps elsewhere after all is copied here by the mapping.
        void* const at =
            queue.enqueueMapBuffer(*opencl_->buffer, CL_FALSE, CL_MAP_READ, 0, opencl_->memory.size_bytes());
        queue.enqueueUnmapMemObject(*opencl_->buffer, at, nullptr, &opencl_->shown);
    });
}

void HostMemory::wait() {
    guarded("wait for memory of the host's", opencl_->name(), [&] { opencl_->shown.wait(); });
}

}  // namespace btfield::detail
