#pragma once

// From what regional models add up to, and the conditional mean, to the picture's planes (theory 18.5).

#include <cstdint>
#include <vector>

#include "btfield/compound.hpp"
#include "host/cl/device_impl.hpp"
#include "host/cl/device_planes.hpp"

namespace btfield::detail {

class RegionRestorer {
  public:
    /// \throws InputError when marginals of one region have unlike numbers of knots
    RegionRestorer(DeviceImpl& device, const CompoundModel& model);

    /// \param planes of RegionalFields
    /// \param mean   of ConditionalMean, taken over
    [[nodiscard]] DevicePlanes restore(const DevicePlanes& planes, DevicePlanes mean, const Buffer& labels,
                                       std::uint64_t seed) const;

  private:
    [[nodiscard]] DevicePlanes treat_borders(DevicePlanes planes, const Buffer& labels,
                                             std::uint64_t seed) const;

    DeviceImpl* device_;
    Borders borders_;
    int planes_, rank_, knot_stride_;
    Buffer numbers_, tables_;
};

}  // namespace btfield::detail
