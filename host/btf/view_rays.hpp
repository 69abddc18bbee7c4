#pragma once

// Where the rays of a view meet a relief, and planes of the surface as the view shows them (theory 21.1).

#include <array>
#include <span>
#include <vector>

#include "btfield/image.hpp"
#include "host/base/eigen.hpp"
#include "host/cl/device_impl.hpp"

namespace btfield::detail {

/// Of each pixel of a view, the place on the surface that it shows, in pixels; beyond the edges where the
/// torus is to continue.
struct ViewRays {
    Size size;
    std::vector<float> columns, rows;
};

/// The same in device memory.
struct DeviceRays {
    Buffer x, y;
};

/// A relief on the device.
class RelievedSurface {
  public:
    /// \param height  one plane in pixels, 0 the plane of the pictures; it continues as a torus
    RelievedSurface(DeviceImpl& device, const Image& height);
    /// \param view  unit vector to the viewer, x right, y up, z above 0
    /// \param step  n: of every n-th row, from the first on
    [[nodiscard]] ViewRays rays(const std::array<double, 3>& view, int step = 1) const;
    [[nodiscard]] DeviceRays device_rays(const std::array<double, 3>& view, int step = 1) const;
    [[nodiscard]] Size size() const { return size_; }

  private:
    DeviceImpl* device_;
    Size size_;
    Buffer height_;
    float highest_ = 0.0F, lowest_ = 0.0F;
};

/// S of a view: linear interpolation of surface planes at what its pixels show, and its adjoint. Planes are
/// matrices of a row for each pixel.
class SurfaceGather {
  public:
    /// \param periodic  whether the surface continues; else pixels whose rays leave it count as 0
    SurfaceGather(const ViewRays& rays, bool periodic);
    /// Pixels that count.
    [[nodiscard]] std::size_t count() const { return count_; }
    [[nodiscard]] bool counts(std::size_t pixel) const { return taps_[pixel].down >= 0.0F; }
    /// What it holds for each.
    [[nodiscard]] static constexpr std::size_t bytes_of_pixel() { return sizeof(Tap); }
    /// S T of pixels [first, first + rows of result).
    void gather(const RowMajorMatrix& surface, std::size_t first, Eigen::Ref<RowMajorMatrix> result) const;
    /// surface += Sᵀ picture
    void scatter(const RowMajorMatrix& picture, std::size_t first, RowMajorMatrix& surface) const;

  private:
    struct Tap {
        int row, below;  ///< index of their first pixels
        int left, right;
        float across, down;  ///< down < 0: the pixel does not count
    };
    std::vector<Tap> taps_;
    std::size_t count_ = 0;
};

}  // namespace btfield::detail
