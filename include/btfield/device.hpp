#pragma once

/// \file
/// An OpenCL device, opened once and passed to whatever computes on it. No globals: two can coexist. Any
/// number of threads may use one at a time (docs/library.md).

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "btfield/api.hpp"

namespace btfield {

namespace detail {
class Buffer;
class DeviceImpl;
}  // namespace detail

enum class DeviceType { cpu, gpu, accelerator };
/// "cpu", "gpu", "accelerator".
[[nodiscard]] BTFIELD_API std::string_view name(DeviceType type);

struct DeviceInfo {
    std::string platform;
    std::string name;
    DeviceType type = DeviceType::cpu;
    bool is_default = false;  ///< the one that spec "auto" opens
    int platform_index = 0;   ///< with device_index, the numbers of spec "PLATFORM:DEVICE"; −1 where a
                              ///< program's own context has a part of a device
    int device_index = 0;
    int compute_units = 0;
    int vector_width = 0;  ///< native float lanes
    std::uint64_t memory_bytes = 0;
};

/// Every OpenCL device of every platform, in platform order; empty when there is none.
[[nodiscard]] BTFIELD_API std::vector<DeviceInfo> list_devices();

/// Which FFT computes the transforms.
enum class FftBackend {
    automatic,  ///< lanes on CPU devices, clFFT on others
    lanes,      ///< kernels/fft.cl, vector lanes across transforms
    clfft,
};

struct DeviceOptions {
    int vector_width = 0;     ///< lanes of the hot kernels: 1, 4, 8, 16; 0 = native on CPUs, 1 on GPUs
    int work_group_size = 0;  ///< local size of 1D launches; 0 = chosen per device
    bool profile = false;     ///< collect the time of every launch
    FftBackend fft = FftBackend::automatic;
    /// Where built programs are kept; empty = $BTFIELD_CACHE_DIR, else $XDG_CACHE_HOME/btfield, else
    /// ~/.cache/btfield. A cache that cannot be written is done without.
    std::filesystem::path cache_dir;
    bool disk_cache = true;
    /// Threads that a CPU device computes with at most; of other devices it counts for nothing. 0 =
    /// $BTFIELD_THREADS, else all. Intel's driver computes in the thread that waits as well: one more.
    /// What the host computes has its own limit: limit_threads().
    int threads = 0;
    /// Bytes of device memory that work is planned with at most; 0 = $BTFIELD_MEMORY, else 70 % of a CPU
    /// device's memory, 90 % of another's. What is too large is refused with a size that would fit.
    std::uint64_t memory_bytes = 0;
};

/// Time of all launches of one kernel, and what they had to do.
struct ProfileEntry {
    std::string kernel;
    int launches = 0;
    double seconds = 0.0;
    /// Memory that cannot but be read and written once; where a kernel does not tell, that of its buffers.
    double bytes = 0.0;
    /// Operations on 32-bit numbers of what was asked, multiply-adds two; 0 = not known.
    double operations = 0.0;
};

/// Memory of a device that belongs to the caller, in which results can be left: device_memory() in
/// btfield/device_opencl.hpp makes it. Copies mean the same memory.
class BTFIELD_API DeviceMemory {
  public:
    /// For the library's own rooms.
    [[gnu::visibility("hidden")]] DeviceMemory(std::shared_ptr<const detail::Buffer> buffer,
                                               std::size_t offset);
    /// From the offset that it was made with.
    [[nodiscard]] std::size_t bytes() const;
    [[nodiscard]] const detail::Buffer& buffer() const { return *buffer_; }
    [[nodiscard]] std::size_t offset() const { return offset_; }

  private:
    std::shared_ptr<const detail::Buffer> buffer_;
    std::size_t offset_;
};

class BTFIELD_API Device {
  public:
    /// \param spec "auto" (a GPU, else a CPU, else anything), "cpu", "gpu", "PLATFORM:DEVICE" (two indices as
    ///     `btfield devices` lists them, or substrings), or a substring of a device name; empty =
    ///     $BTFIELD_DEVICE, else "auto"
    /// \throws DeviceError when nothing matches, listing what there is
    /// \throws InputError for a vector width that does not exist, a negative number of threads, or
    ///     $BTFIELD_THREADS or $BTFIELD_MEMORY that are no such numbers
    explicit Device(std::string_view spec = {}, const DeviceOptions& options = {});
    ~Device();
    Device(Device&&) noexcept;
    Device& operator=(Device&&) noexcept;

    [[nodiscard]] const DeviceInfo& info() const;
    /// Lanes that hot kernels are built with.
    [[nodiscard]] int vector_width() const;
    /// Launches since opening or the last call, most expensive first. Empty unless DeviceOptions::profile.
    [[nodiscard]] std::vector<ProfileEntry> take_profile();
    /// Kernel launches since opening.
    [[nodiscard]] std::uint64_t launch_count() const;
    /// Waits until all that was enqueued is done: results left on the device are there.
    void finish();

    /// For the library's own rooms.
    [[nodiscard]] detail::DeviceImpl& impl();
    [[gnu::visibility("hidden")]] explicit Device(std::unique_ptr<detail::DeviceImpl> impl);

  private:
    std::unique_ptr<detail::DeviceImpl> impl_;
};

}  // namespace btfield
