#pragma once

// E[Y | X around r]: the picture as far as the labels around each pixel tell it (theory 18.3).

#include <array>
#include <vector>

#include "btfield/compound.hpp"
#include "host/cl/device_impl.hpp"
#include "host/cl/device_planes.hpp"

namespace btfield::detail {

/// What smooths scale s to the next, s = 0 … 3: weights at 0, ±2^s and ±2·2^s pixels, along rows and columns.
/// Variances add up to those of σ = 1, 2, 4, 8.
[[nodiscard]] std::array<double, 3> smoothing_taps(int scale);

struct MeanWeights {
    std::vector<double> mean;                  ///< one per plane
    std::vector<std::vector<double>> regions;  ///< as CompoundRegion::weights
};

/// Ridge regression of the picture on the labels' indicators, smoothed and differentiated.
[[nodiscard]] MeanWeights fit_conditional_mean(const Image& image, const ControlField& field);

/// Regional means as weights of a single filter.
[[nodiscard]] MeanWeights regional_means(const Image& image, const ControlField& field);

/// Those of the model.
[[nodiscard]] MeanWeights mean_weights(const CompoundModel& model);

class ConditionalMean {
  public:
    ConditionalMean(DeviceImpl& device, const MeanWeights& weights);

    /// \param labels [row][column], one byte each
    [[nodiscard]] DevicePlanes of(const Buffer& labels, Size size) const;

  private:
    DeviceImpl* device_;
    int planes_, filters_;
    Buffer weights_, mean_;
};

/// On the host.
[[nodiscard]] Image conditional_mean(DeviceImpl& device, const MeanWeights& weights,
                                     const ControlField& field);

}  // namespace btfield::detail
