#pragma once

// Planes of a surface as its views show them (theory 21.3).

#include <span>
#include <vector>

#include "btfield/btf_set.hpp"
#include "btfield/image.hpp"
#include "host/base/eigen.hpp"
#include "host/btf/plane_tone.hpp"
#include "host/btf/view_rays.hpp"

namespace btfield::detail {

/// Means and covariances of planes on a lattice of views, and some pixels of them for the shape of sums.
class SeenPlanes {
  public:
    /// \param surface   height in pixels, then planes
    /// \param steepest  θ of the outermost views; beyond, as there
    SeenPlanes(DeviceImpl& device, const Image& surface, double steepest);
    /// Of the sum of planes with these weights.
    [[nodiscard]] PlaneTone tone(const BtfDirection& view, std::span<const double> weights,
                                 double contrast) const;

  private:
    struct Moments {
        Eigen::VectorXd mean;
        Eigen::MatrixXd square;  ///< second moments
    };
    [[nodiscard]] Moments seen(const RelievedSurface& relief, const Image& surface,
                               const BtfDirection& view) const;

    double steepest_;
    std::vector<Moments> views_;  ///< [ring][φ]
    std::size_t planes_;
    std::vector<float> sample_;  ///< [pixel][plane]
};

}  // namespace btfield::detail
