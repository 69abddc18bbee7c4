#include "host/rendering/lit_shape.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace btfield::detail {
namespace {

using Float4 = std::array<float, 4>;

Float4 float4(const Vector3& v) {
    return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]), 0.0F};
}

/// Numbers of a colour before its weights.
constexpr std::size_t table_head = 4;

Range range_of(Size size) {
    return {static_cast<std::size_t>(size.width), static_cast<std::size_t>(size.height)};
}

/// The texel in the middle of a picture's axis: that of the tile, or the nearest by which pixels 1:1 are
/// texels.
double middle(int picture, int tile) {
    const double own = 0.5 * (picture - 1);
    return own - std::floor(own - 0.5 * (tile - 1) + 0.5);
}

}  // namespace

double sphere_radius(Size picture) {
    return 0.45 * std::min(picture.width, picture.height);
}

LitShape::LitShape(DeviceImpl& device, const Image& surface, int colours)
    : device_(&device),
      size_(surface.size()),
      colours_(colours),
      planes_(surface.planes() - 1),
      padded_((surface.planes() + 2) / 4 * 4),
      relief_(device.upload(surface.plane(0))) {
    const auto [lowest, highest] = std::ranges::minmax_element(surface.plane(0));
    lowest_ = *lowest;
    highest_ = *highest;
    const auto padded = static_cast<std::size_t>(padded_);
    std::vector<float> values(padded * area(size_));
    for (int k = 0; k < planes_; ++k) {
        const auto plane = surface.plane(k + 1);
        for (std::size_t p = 0; p < plane.size(); ++p)
            values[p * padded + static_cast<std::size_t>(k)] = plane[p];
    }
    planes_of_pixels_ = device.upload(values);
}

Kernel LitShape::kernel(const char* name) const {
    BuildParameters parameters;
    parameters.set("BTFIELD_PLANES", padded_).set("BTFIELD_COLOURS", colours_);
    return device_->kernel("lit_shape", name, parameters);
}

Buffer LitShape::upload(const LitTable& table) const {
    const std::size_t row = static_cast<std::size_t>(padded_) + table_head,
                      colours = static_cast<std::size_t>(colours_),
                      planes = static_cast<std::size_t>(planes_);
    std::vector<float> values(row * colours * table.entries.size());
    for (std::size_t i = 0; i < table.entries.size(); ++i) {
        const PictureWeights& entry = table.entries[i];
        for (std::size_t c = 0; c < table.background.size(); ++c)
            values[(i * colours + c) * row + 2] = static_cast<float>(table.background[c]);
        if (entry.mean.empty()) continue;  // neither seen nor lit
        for (std::size_t c = 0; c < colours; ++c) {
            float* const own = values.data() + (i * colours + c) * row;
            own[0] = static_cast<float>(std::log(entry.mean[c]));
            own[1] = static_cast<float>(entry.offsets[c]);
            for (std::size_t k = 0; k < planes; ++k)
                own[table_head + k] = static_cast<float>(entry.weights[c * planes + k]);
        }
    }
    return device_->upload(values);
}

Image LitShape::plane(const BtfScene& scene, const LitView& view, const LitTable& table) const {
    const Vector3 to = view.camera.to;
    // A place of the plane lies 1 / cos theta as far along the view as in the picture.
    const double more = 1.0 / (to[2] * (1.0 + to[2])), scale = 1.0 / scene.scale;
    const auto texels = [&](double value) { return static_cast<float>(scale * value); };
    Image image(scene.size, colours_);
    const Buffer uploaded = upload(table), picture = device_->buffer(image.values().size_bytes());
    device_->launch(kernel("show_plane"), range_of(scene.size), Grain::fine, relief_, planes_of_pixels_,
                    uploaded, size_.width, size_.height, lowest_, highest_, static_cast<float>(to[0]),
                    static_cast<float>(to[1]), static_cast<float>(to[2]), static_cast<float>(view.light[2]),
                    static_cast<float>(middle(scene.size.width, size_.width)),
                    static_cast<float>(middle(scene.size.height, size_.height)),
                    texels(1.0 + more * to[0] * to[0]), texels(more * to[0] * to[1]),
                    texels(1.0 + more * to[1] * to[1]), picture, scene.size.width, scene.size.height);
    device_->read(picture, image.values().data(), image.values().size_bytes());
    return image;
}

Image LitShape::sphere(const BtfScene& scene, const LitView& view, const LitTable& table) const {
    const double radian =
        tiles_around(scene, size_.width) * static_cast<double>(size_.width) / (2.0 * std::numbers::pi);
    Image image(scene.size, colours_);
    const Buffer uploaded = upload(table), picture = device_->buffer(image.values().size_bytes());
    device_->launch(kernel("show_sphere"), range_of(scene.size), Grain::fine, relief_, planes_of_pixels_,
                    uploaded, table.longitudes, table.latitudes, size_.width, size_.height, lowest_, highest_,
                    float4(view.camera.right), float4(view.camera.up), float4(view.camera.to),
                    float4(view.light), static_cast<float>(sphere_radius(scene.size)),
                    static_cast<float>(radian), static_cast<float>(std::cos(view.steepest_view)),
                    static_cast<float>(std::sin(view.steepest_view)), picture, scene.size.width,
                    scene.size.height);
    device_->read(picture, image.values().data(), image.values().size_bytes());
    return image;
}

}  // namespace btfield::detail
