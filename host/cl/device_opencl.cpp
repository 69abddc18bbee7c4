#include "btfield/device_opencl.hpp"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "host/cl/api.hpp"
#include "host/cl/device_choice.hpp"
#include "host/cl/device_impl.hpp"

namespace btfield {

using namespace detail;

namespace {

const std::string asked_for_device = "open a device on a context of the program's own";

[[noreturn]] void refuse_device(const std::string& found, const std::string& remedy) {
    throw InputError(asked_for_device, found, remedy);
}

/// \throws InputError unless the queue is one that a Device can use
void check_queue(const cl::CommandQueue& queue, const cl::Context& context, const cl::Device& device,
                 const DeviceOptions& options) {
    if (queue.getInfo<CL_QUEUE_CONTEXT>()() != context())
        refuse_device("the queue belongs to another context", "give a queue of this one");
    if (queue.getInfo<CL_QUEUE_DEVICE>()() != device())
        refuse_device("the queue belongs to another device", "give a queue of this one");
    const auto properties = queue.getInfo<CL_QUEUE_PROPERTIES>();
    if (properties & CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE)
        refuse_device("the queue is out of order", "give one that is in order, or none");
    if (options.profile && !(properties & CL_QUEUE_PROFILING_ENABLE))
        refuse_device("a profile is asked for of a queue that does not profile",
                      "make the queue with CL_QUEUE_PROFILING_ENABLE, or give none");
}

}  // namespace

DeviceMemory::DeviceMemory(std::shared_ptr<const Buffer> buffer, std::size_t offset)
    : buffer_(std::move(buffer)), offset_(offset) {}

std::size_t DeviceMemory::bytes() const {
    return buffer_->bytes() - offset_;
}

Device device_of(const OpenClHandles& handles, const DeviceOptions& options) {
    if (handles.context == nullptr) refuse_device("there is no context", "give one");
    if (handles.device == nullptr) refuse_device("there is no device", "give one of the context's");
    if (options.threads != 0)
        refuse_device("a number of threads is given", "make the context for a part of the device instead");
    return guarded(asked_for_device, "of the program's own", [&] {
        const cl::Context context(handles.context, true);
        const cl::Device device(handles.device, true);
        const std::vector<cl::Device> devices = context.getInfo<CL_CONTEXT_DEVICES>();
        if (std::none_of(devices.begin(), devices.end(),
                         [&](const cl::Device& d) { return d() == device(); }))
            refuse_device("the device is none of the context's", "give one of its devices");
        const DeviceCandidate candidate{device, info_of(device)};
        if (handles.queue == nullptr)
            return Device(std::make_unique<DeviceImpl>(candidate, context, nullptr, options));
        const cl::CommandQueue queue(handles.queue, true);
        check_queue(queue, context, device, options);
        return Device(std::make_unique<DeviceImpl>(candidate, context, &queue, options));
    });
}

OpenClHandles opencl_handles(Device& device) {
    const DeviceImpl& impl = device.impl();
    return {impl.context()(), impl.device()(), impl.queue()()};
}

DeviceMemory device_memory(Device& device, _cl_mem* memory, std::size_t offset) {
    const std::string asked = "use memory of the program's own";
    if (memory == nullptr) throw InputError(asked, "there is none", "give a buffer");
    return guarded(asked, device.info().name, [&] {
        auto buffer = std::make_shared<cl::Buffer>(memory, true);
        if (buffer->getInfo<CL_MEM_CONTEXT>()() != device.impl().context()())
            throw InputError(asked, "it belongs to another context than the device",
                             "open the device with device_of() on the memory's context");
        if (buffer->getInfo<CL_MEM_TYPE>() != CL_MEM_OBJECT_BUFFER)
            throw InputError(asked, "it is an image or a pipe", "give a buffer");
        if (buffer->getInfo<CL_MEM_FLAGS>() & CL_MEM_READ_ONLY)
            throw InputError(asked, "it cannot be written on the device",
                             "make it with CL_MEM_READ_WRITE or CL_MEM_WRITE_ONLY");
        const std::size_t bytes = buffer->getInfo<CL_MEM_SIZE>();
        if (offset > bytes)
            throw InputError(asked,
                             "it holds " + std::to_string(bytes) + " bytes, fewer than the offset of " +
                                 std::to_string(offset),
                             "give a smaller offset");
        return DeviceMemory(std::make_shared<const Buffer>(Buffer::foreign(std::move(buffer), bytes)),
                            offset);
    });
}

}  // namespace btfield
