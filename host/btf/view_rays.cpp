#include "host/btf/view_rays.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/wide.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;

BTFIELD_WIDE void interpolate(const double* const* corners, double across, double down, double* result,
                              std::size_t planes) {
    const double *a = corners[0], *b = corners[1], *c = corners[2], *d = corners[3];
    const double wa = (1.0 - across) * (1.0 - down), wb = across * (1.0 - down), wc = (1.0 - across) * down,
                 wd = across * down;
    for (std::size_t k = 0; k < planes; ++k) result[k] = wa * a[k] + wb * b[k] + wc * c[k] + wd * d[k];
}

BTFIELD_WIDE void spread(const double* value, double across, double down, double* const* corners,
                         std::size_t planes) {
    const double weights[] = {(1.0 - across) * (1.0 - down), across * (1.0 - down), (1.0 - across) * down,
                              across * down};
    // One after the other: on a torus of one row or column they are the same.
    for (std::size_t corner = 0; corner < 4; ++corner)
        for (std::size_t k = 0; k < planes; ++k) corners[corner][k] += weights[corner] * value[k];
}

}  // namespace

RelievedSurface::RelievedSurface(DeviceImpl& device, const Image& height)
    : device_(&device), size_(height.size()), height_(device.upload(height.values())) {
    const auto [lowest, highest] = std::ranges::minmax_element(height.values());
    lowest_ = *lowest;
    highest_ = *highest;
}

DeviceRays RelievedSurface::device_rays(const std::array<double, 3>& view, int step) const {
    const Size seen{(size_.height + step - 1) / step, size_.width};
    const std::size_t bytes = sizeof(float) * area(seen);
    DeviceRays rays{device_->buffer(bytes), device_->buffer(bytes)};
    device_->launch(device_->kernel("view_rays", "meet_relief", BuildParameters()),
                    {static_cast<std::size_t>(seen.width), static_cast<std::size_t>(seen.height)},
                    Grain::fine, height_, static_cast<float>(view[0]), static_cast<float>(view[1]),
                    static_cast<float>(view[2]), lowest_, highest_, rays.x, rays.y, size_.width, size_.height,
                    step);
    return rays;
}

ViewRays RelievedSurface::rays(const std::array<double, 3>& view, int step) const {
    const DeviceRays rays = device_rays(view, step);
    const Size seen{(size_.height + step - 1) / step, size_.width};
    ViewRays result{seen, std::vector<float>(area(seen)), std::vector<float>(area(seen))};
    device_->read(rays.x, result.columns.data(), sizeof(float) * area(seen));
    device_->read(rays.y, result.rows.data(), sizeof(float) * area(seen));
    return result;
}

SurfaceGather::SurfaceGather(const ViewRays& rays, bool periodic) : taps_(area(rays.size)) {
    const int height = rays.size.height, width = rays.size.width;
    const auto around = [](int i, int n) { return (i % n + n) % n; };
    for (std::size_t p = 0; p < taps_.size(); ++p) {
        const float x = rays.columns[p], y = rays.rows[p], left = std::floor(x), top = std::floor(y);
        const int column = static_cast<int>(left), row = static_cast<int>(top);
        Tap& tap = taps_[p];
        tap = {around(row, height) * width,
               around(row + 1, height) * width,
               around(column, width),
               around(column + 1, width),
               x - left,
               y - top};
        const bool inside = x >= 0.0F && y >= 0.0F && x <= static_cast<float>(width - 1) &&
                            y <= static_cast<float>(height - 1);
        if (periodic || inside)
            ++count_;
        else
            tap.down = -1.0F;
    }
}

void SurfaceGather::gather(const RowMajorMatrix& surface, std::size_t first,
                           Eigen::Ref<RowMajorMatrix> result) const {
    const auto planes = static_cast<std::size_t>(surface.cols());
    for (Index i = 0; i < result.rows(); ++i) {
        const Tap& tap = taps_[first + static_cast<std::size_t>(i)];
        double* const to = result.data() + i * result.outerStride();
        if (tap.down < 0.0F) {
            std::fill_n(to, planes, 0.0);
            continue;
        }
        const auto at = [&](int row, int column) {
            return surface.data() + static_cast<std::size_t>(row + column) * planes;
        };
        const double* const corners[] = {at(tap.row, tap.left), at(tap.row, tap.right),
                                         at(tap.below, tap.left), at(tap.below, tap.right)};
        interpolate(corners, static_cast<double>(tap.across), static_cast<double>(tap.down), to, planes);
    }
}

void SurfaceGather::scatter(const RowMajorMatrix& picture, std::size_t first, RowMajorMatrix& surface) const {
    const auto planes = static_cast<std::size_t>(surface.cols());
    for (Index i = 0; i < picture.rows(); ++i) {
        const Tap& tap = taps_[first + static_cast<std::size_t>(i)];
        if (tap.down < 0.0F) continue;
        const auto at = [&](int row, int column) {
            return surface.data() + static_cast<std::size_t>(row + column) * planes;
        };
        double* const corners[] = {at(tap.row, tap.left), at(tap.row, tap.right), at(tap.below, tap.left),
                                   at(tap.below, tap.right)};
        spread(picture.data() + i * picture.outerStride(), static_cast<double>(tap.across),
               static_cast<double>(tap.down), corners, planes);
    }
}

}  // namespace btfield::detail
