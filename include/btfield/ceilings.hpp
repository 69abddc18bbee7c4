#pragma once

/// \file
/// What a device reaches at most, measured: beside it stands what its kernels reach (Device::take_profile()).

#include "btfield/api.hpp"
#include "btfield/device.hpp"

namespace btfield {

struct Ceilings {
    double bytes_per_second = 0.0;       ///< of a copy between two buffers, read and written bytes together
    double operations_per_second = 0.0;  ///< float32, of multiply-adds in registers, which count two
    double launch_seconds = 0.0;         ///< of one launch among many, of a kernel that does nothing
};

/// The best of several short runs; takes less than a second on most devices. What else runs on the machine
/// lowers it.
/// \throws DeviceError when the device fails
[[nodiscard]] BTFIELD_API Ceilings measure_ceilings(Device& device);

/// The part of the nearer ceiling that a kernel reached: the larger of its share of the copy's bandwidth and
/// of the arithmetic peak. Above 1 where caches served it. 0 where neither its bytes nor its operations are
/// known.
[[nodiscard]] BTFIELD_API double share_of_ceiling(const ProfileEntry& kernel, const Ceilings& ceilings);

}  // namespace btfield
