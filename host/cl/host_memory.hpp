#pragma once

/// \file
/// Memory of the host's in place of the device's own, where both are the same.

#include <memory>
#include <span>

#include "host/cl/device_impl.hpp"

namespace btfield::detail {

/// Large memory of the host's that launches write like a buffer: what they leave there is not copied. Move
/// only; outlived by the memory, and by the device.
class HostMemory {
  public:
    /// Whether it saves anything: the device works where the memory lies, which drivers grant at such
    /// alignments, and the memory is worth a buffer of its own.
    [[nodiscard]] static bool suits(const DeviceImpl& device, std::span<const float> memory);

    HostMemory(DeviceImpl& device, std::span<float> memory);
    HostMemory(HostMemory&&) noexcept;
    HostMemory& operator=(HostMemory&&) noexcept;
    /// Waits for what was enqueued with it.
    ~HostMemory();

    /// Valid while this lives; any number of them.
    [[nodiscard]] Buffer buffer() const;
    /// Enqueues that the host is to see what was enqueued before; nothing is to be enqueued with it after.
    void show();
    /// Blocks until it does.
    void wait();

  private:
    struct OpenCl;
    std::unique_ptr<OpenCl> opencl_;
};

}  // namespace btfield::detail
