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

}  // namespace btfield::detail
