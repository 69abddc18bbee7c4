#pragma once

/// \file
/// Pyramid steps on planes that are already in device memory.

#include "btfield/image.hpp"
#include "host/cl/device_impl.hpp"
#include "host/cl/device_planes.hpp"

namespace btfield::detail {

/// The kernels and weights of one reduction factor on one device.
class PyramidStages {
  public:
    PyramidStages(DeviceImpl& device, int factor);

    /// ↓n(fine ⊗ w). `fine` must fill its lattice.
    [[nodiscard]] DevicePlanes reduce(const DevicePlanes& fine);
    /// base + scale · ↑n(coarse), of base's size, filling its lattice. May take over base's memory.
    /// \param first  of the coarse planes that belong to base's
    [[nodiscard]] DevicePlanes add_expanded(DevicePlanes base, const DevicePlanes& coarse, float scale,
                                            int first = 0);

  private:
    [[nodiscard]] Kernel kernel(const char* name);
    /// Of the kernel along one axis.
    [[nodiscard]] double taps() const;

    DeviceImpl* device_;
    int factor_;
    Buffer reduce_weights_, expand_weights_;
};

}  // namespace btfield::detail
