#pragma once

/// \file
/// An OpenCL device, opened once and passed to whatever computes on it. No globals: two can coexist. One is
/// for one thread at a time (docs/library.md).

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "btfield/api.hpp"

namespace btfield {

namespace detail {
class DeviceImpl;
}

enum class DeviceType { cpu, gpu, accelerator };
/// "cpu", "gpu", "accelerator".
[[nodiscard]] BTFIELD_API std::string_view name(DeviceType type);

struct DeviceInfo {
    std::string platform;
    std::string name;
    DeviceType type = DeviceType::cpu;
    bool is_default = false;  ///< the one that spec "auto" opens
    int platform_index = 0;   ///< with device_index, the numbers of spec "PLATFORM:DEVICE"
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
};

/// Time of all launches of one kernel.
struct ProfileEntry {
    std::string kernel;
    int launches = 0;
    double seconds = 0.0;
};

class BTFIELD_API Device {
  public:
    /// \param spec "auto" (a GPU, else a CPU, else anything), "cpu", "gpu", "PLATFORM:DEVICE" (two indices as
    ///     `btfield devices` lists them, or substrings), or a substring of a device name; empty =
    ///     $BTFIELD_DEVICE, else "auto"
    /// \throws DeviceError when nothing matches, listing what there is
    /// \throws InputError for a vector width that does not exist
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

    /// For the library's own rooms.
    [[nodiscard]] detail::DeviceImpl& impl();

  private:
    std::unique_ptr<detail::DeviceImpl> impl_;
};

}  // namespace btfield
