#pragma once

#include "btfield/device.hpp"
#include "python/src/work.hpp"

namespace btfield::python {

/// btfield.Device.
using PyDevice = Held<Device>;

}  // namespace btfield::python
