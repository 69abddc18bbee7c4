#pragma once

/// \file
/// btfield inside of a program that uses OpenCL itself: a Device on the program's own context and queue, and
/// results left in the program's memory. OpenCL's handles are named as CL/cl.h declares them (`cl_mem` is
/// `_cl_mem*`, and so on), which this header does without.

#include <cstddef>

#include "btfield/api.hpp"
#include "btfield/device.hpp"

// NOLINTBEGIN(bugprone-reserved-identifier): CL/cl.h's names
struct _cl_command_queue;
struct _cl_context;
struct _cl_device_id;
struct _cl_mem;
// NOLINTEND(bugprone-reserved-identifier)

namespace btfield {

/// What a Device computes with. Whoever takes these does not own them: who keeps one retains it.
struct OpenClHandles {
    _cl_context* context = nullptr;
    _cl_device_id* device = nullptr;  ///< one of the context's
    /// In order, of this context and device; without one, a Device makes its own.
    _cl_command_queue* queue = nullptr;
};

/// A Device on handles of the caller, which it retains as long as it lives. All of its work goes to the queue
/// in order: what the caller enqueues there waits for it, and the other way round.
/// \throws InputError when context or device is missing, the device is none of the context's, the queue
///     belongs to others or is out of order, `profile` is asked of a queue that does not profile, or a number
///     of threads is given: whoever made the context has chosen the device
/// \throws DeviceError when OpenCL refuses
[[nodiscard]] BTFIELD_API Device device_of(const OpenClHandles& handles, const DeviceOptions& options = {});

/// What a device computes with, the queue included. Valid as long as the device lives, and longer where they
/// are retained.
[[nodiscard]] BTFIELD_API OpenClHandles opencl_handles(Device& device);

/// Memory of the caller, in the device's context, from `offset` bytes to its end; retained as long as the
/// result or a copy of it lives.
/// \throws InputError when there is none, it belongs to another context, cannot be written by kernels, is no
///     plain buffer, or ends before the offset
[[nodiscard]] BTFIELD_API DeviceMemory device_memory(Device& device, _cl_mem* memory, std::size_t offset = 0);

}  // namespace btfield
