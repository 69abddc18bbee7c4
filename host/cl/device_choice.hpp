#pragma once

/// \file
/// Which device a specification names.

#include <string_view>

#include "btfield/device.hpp"
#include "host/cl/api.hpp"

namespace btfield::detail {

/// A device of this machine, as the driver and as list_devices() know it.
struct DeviceCandidate {
    cl::Device device;
    DeviceInfo info;
};

/// The device that Device's constructor opens for this specification.
/// \throws DeviceError when there is none
[[nodiscard]] DeviceCandidate choose_device(std::string_view asked);

/// What is known of a device of anybody's; platform_index is −1 where it is none of list_devices().
[[nodiscard]] DeviceInfo info_of(const cl::Device& device);

/// Of a CPU device, the part that computes with at most so many threads; all of it for 0 where
/// $BTFIELD_THREADS says nothing.
/// \throws InputError below 0, or when $BTFIELD_THREADS is no whole number from 1 on
/// \throws DeviceError when the driver does not divide its device
void restrict_threads(DeviceCandidate& candidate, int threads);

}  // namespace btfield::detail
