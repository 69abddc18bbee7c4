#include "host/btf/surface_view.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace btfield::detail {
namespace {

/// Views whose rays are kept: pictures of one view under many lights come after each other.
constexpr std::size_t kept_views = 4;
Image first_plane(const Image& image) {
    Image plane(image.size(), 1);
    std::ranges::copy(image.plane(0), plane.values().begin());
    return plane;
}

}  // namespace

std::vector<float> planes_by_pixel(const Image& surface, int padded) {
    const auto stride = static_cast<std::size_t>(padded);
    std::vector<float> values(stride * area(surface.size()));
    for (int k = 1; k < surface.planes(); ++k) {
        const auto plane = surface.plane(k);
        for (std::size_t p = 0; p < plane.size(); ++p)
            values[p * stride + static_cast<std::size_t>(k - 1)] = plane[p];
    }
    return values;
}

SurfaceView::SurfaceView(DeviceImpl& device, const Image& surface, int colours)
    : device_(&device),
      size_(surface.size()),
      colours_(colours),
      planes_(surface.planes() - 1),
      padded_((surface.planes() + 2) / 4 * 4),
      relief_(device, first_plane(surface)) {
    planes_of_pixels_ = device.upload(planes_by_pixel(surface, padded_));
}

SurfaceView::Rays SurfaceView::rays(const std::array<double, 3>& view) const {
    const std::lock_guard lock(mutex_);
    for (const auto& [own, rays] : kept_)
        if (own == view) return rays;
    Rays made = std::make_shared<const DeviceRays>(relief_.device_rays(view));
    if (kept_.size() >= kept_views) kept_.pop_front();
    kept_.emplace_back(view, made);
    return made;
}

Image SurfaceView::weighted(const std::array<double, 3>& view, const PictureWeights& weights) const {
    const Rays seen = rays(view);
    const auto stride = static_cast<std::size_t>(padded_);
    std::vector<float> table(stride * static_cast<std::size_t>(colours_));
    for (std::size_t c = 0; c < static_cast<std::size_t>(colours_); ++c) {
        float* const own = table.data() + c * stride;
        for (std::size_t k = 0; k < static_cast<std::size_t>(planes_); ++k)
            own[k] = static_cast<float>(weights.weights[c * static_cast<std::size_t>(planes_) + k]);
    }
    Image image(size_, colours_);
    const std::size_t pixels = area(size_);
    const Buffer uploaded = device_->upload(table),
                 weighted = device_->buffer(sizeof(float) * pixels * static_cast<std::size_t>(colours_)),
                 picture = device_->buffer(image.values().size_bytes());
    BuildParameters parameters;
    parameters.set("BTFIELD_PLANES", padded_).set("BTFIELD_COLOURS", colours_);
    device_->launch(device_->kernel("view_rays", "weigh_planes", parameters), {pixels}, Grain::fine,
                    planes_of_pixels_, uploaded, weighted, static_cast<int>(pixels));
    BuildParameters of_colours;
    of_colours.set("BTFIELD_COLOURS", colours_);
    device_->launch(device_->kernel("view_rays", "show_weighted", of_colours),
                    {static_cast<std::size_t>(size_.width), static_cast<std::size_t>(size_.height)},
                    Grain::fine, weighted, seen->x, seen->y, picture, size_.width, size_.height);
    device_->read(picture, image.values().data(), image.values().size_bytes());
    return image;
}

Image SurfaceView::picture(const std::array<double, 3>& view, const PictureWeights& weights) const {
    Image image = weighted(view, weights);
    for (int c = 0; c < colours_; ++c) {
        const auto colour = static_cast<std::size_t>(c);
        const PlaneTone tone = PlaneDistribution(image.plane(c)).tone(weights.contrast[colour]);
        const auto root = std::sqrt(weights.mean[colour]);
        const auto offset = static_cast<float>(root * tone.offset),
                   slope = static_cast<float>(root * tone.slope);
        for (float& value : image.plane(c)) {
            const float z = std::max(0.0F, offset + slope * value);
            value = z * z;
        }
    }
    return image;
}

}  // namespace btfield::detail
