#pragma once

// The fields that regional models describe, every pixel by the model of its region (theory 18.5; P1 2.3).

#include <optional>
#include <span>
#include <vector>

#include "btfield/models.hpp"
#include "host/analysis/pyramid_stages.hpp"
#include "host/cl/device_impl.hpp"
#include "host/cl/device_planes.hpp"
#include "host/synthesis/spectral_factors.hpp"
#include "host/synthesis/synthesis_layout.hpp"

namespace btfield::detail {

class RegionalFields {
  public:
    /// \param regions of one pyramid factor, in the order of the labels
    RegionalFields(DeviceImpl& device, std::span<const TextureModel* const> regions, Size size);

    [[nodiscard]] const SynthesisLayout& layout() const { return layout_; }
    /// Planes that come out: as many as the region that has most.
    [[nodiscard]] int planes() const { return planes_; }

    /// Sum of the levels, before any marginal.
    /// \param labels of layout().lattice, one byte each
    /// \param keys   two words of one seed
    [[nodiscard]] DevicePlanes grow(const Buffer& labels, const Buffer& keys);
    /// One of the levels at full size.
    [[nodiscard]] DevicePlanes grow_alone(std::size_t level, const Buffer& labels, const Buffer& keys);

  private:
    /// Region whose level is solved in frequency.
    struct SpectralRegion {
        int region = 0, planes = 0;
        SpectralFactors factors;
    };
    /// One level: moving averages together, others one after the other.
    struct Level {
        int offsets_count = 0, reach = 0;
        Buffer coefficients, offsets;
        std::vector<SpectralRegion> spectral;
    };

    void add_level(std::span<const TextureModel* const> regions, std::size_t k, double budget);
    [[nodiscard]] DevicePlanes grow_level(std::size_t k, const Buffer& labels, const Buffer& keys);
    void add_spectral(const SpectralRegion& own, std::size_t k, const Buffer& labels, const Buffer& keys,
                      const Buffer& sum);

    DeviceImpl* device_;
    int planes_ = 0, factor_;
    SynthesisLayout layout_;
    PyramidStages stages_;
    std::vector<Level> levels_;
};

}  // namespace btfield::detail
