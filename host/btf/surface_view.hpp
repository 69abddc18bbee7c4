#pragma once

// Pictures of planes of a surface, seen through its relief (theory 21.1).

#include <array>
#include <deque>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "btfield/image.hpp"
#include "host/btf/direction_table.hpp"
#include "host/btf/view_rays.hpp"

namespace btfield::detail {

/// As kernels take them: planes behind the first, [pixel][padded], with zeros behind.
[[nodiscard]] std::vector<float> planes_by_pixel(const Image& surface, int padded);

/// For any number of threads.
class SurfaceView {
  public:
    /// \param surface  height in pixels, then planes
    SurfaceView(DeviceImpl& device, const Image& surface, int colours);
    /// [colour]: Σ_k weight_k T_k where the view shows it, as deep as gives the picture its mean and
    /// contrast.
    [[nodiscard]] Image picture(const std::array<double, 3>& view, const PictureWeights& weights) const;

  private:
    /// Σ_k weight_k T_k where the view shows it.
    [[nodiscard]] Image weighted(const std::array<double, 3>& view, const PictureWeights& weights) const;
    using Rays = std::shared_ptr<const DeviceRays>;
    [[nodiscard]] Rays rays(const std::array<double, 3>& view) const;

    DeviceImpl* device_;
    Size size_;
    int colours_, planes_, padded_;
    RelievedSurface relief_;
    Buffer planes_of_pixels_;
    mutable std::mutex mutex_;  ///< of what follows
    mutable std::deque<std::pair<std::array<double, 3>, Rays>> kept_;
};

}  // namespace btfield::detail
