#pragma once

#include "btfield/image.hpp"
#include "host/cl/buffer_pool.hpp"

namespace btfield::detail {

/// Planes in device memory, [plane][row of lattice][column of lattice], of which `size` counts and wraps.
struct DevicePlanes {
    Buffer values;
    Size size;
    Size lattice;
    int planes = 0;
};

}  // namespace btfield::detail
