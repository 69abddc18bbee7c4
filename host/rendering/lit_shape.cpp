#include "host/rendering/lit_shape.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "host/btf/surface_view.hpp"
#include "host/rendering/shape_places.hpp"

namespace btfield::detail {
namespace {

using Float4 = std::array<float, 4>;

Float4 float4(const Vector3& v) {
    return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]), 0.0F};
}

/// Numbers of a colour before its weights.
constexpr std::size_t table_head = 4;

/// Floats of places that a band may take.
constexpr std::size_t most_places = std::size_t{1} << 24;

Range range_of(int columns, int rows, int samples = 1) {
    return {static_cast<std::size_t>(columns), static_cast<std::size_t>(rows),
            static_cast<std::size_t>(samples)};
}

}  // namespace

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
    planes_of_pixels_ = device.upload(planes_by_pixel(surface, padded_));
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

template <class Place, class Show>
Image LitShape::picture(Size size, int samples, std::shared_ptr<const Buffer>& met, const Place& place,
                        const Show& show) const {
    Image image(size, colours_);
    const int columns = size.width,
              most_rows = static_cast<int>(std::clamp<std::size_t>(
                  most_places / (2 * static_cast<std::size_t>(samples) * static_cast<std::size_t>(columns)),
                  1, static_cast<std::size_t>(size.height)));
    const std::size_t pixels = static_cast<std::size_t>(most_rows) * static_cast<std::size_t>(columns);
    const Buffer picture = device_->buffer(image.values().size_bytes());
    const bool known = met != nullptr;
    if (!known)
        met = std::make_shared<const Buffer>(
            device_->buffer(2 * static_cast<std::size_t>(samples) * pixels * sizeof(float)));
    const Buffer rays = device_->buffer(3 * pixels * sizeof(float));
    for (int first = 0; first < size.height; first += most_rows) {
        const int band = std::min(most_rows, size.height - first);
        if (!known) {
            place(*met, rays, first, band);
            device_->launch(device_->kernel("lit_shape", "meet_places", BuildParameters()),
                            range_of(band * columns, samples), Grain::fine, relief_, rays, lowest_, highest_,
                            *met, samples, size_.width, size_.height, band * columns);
        }
        show(picture, *met, first, band);
    }
    if (most_rows < size.height) met.reset();
    device_->read(picture, image.values().data(), image.values().size_bytes());
    return image;
}

Image LitShape::plane(const BtfScene& scene, const LitView& view, const LitTable& table) const {
    const Vector3 to = view.camera.to;
    const PlanePlaces at = plane_places(scene, view.camera, size_);
    const int columns = scene.size.width, rows = scene.size.height;
    const Buffer uploaded = upload(table);
    const auto single = [](double value) { return static_cast<float>(value); };
    Met met{scene.size, scene.scale, to, nullptr};
    {
        const std::lock_guard lock(mutex_);
        if (met_.size == met.size && met_.scale == met.scale && met_.to == met.to) met.places = met_.places;
    }
    Image image = picture(
        scene.size, at.across * at.down, met.places,
        [&](const Buffer& places, const Buffer& rays, int first, int band) {
            device_->launch(device_->kernel("lit_shape", "place_plane", BuildParameters()),
                            range_of(columns, band, at.across * at.down), Grain::fine, single(to[0]),
                            single(to[1]), single(to[2]), single(at.x), single(at.y), single(at.xx),
                            single(at.xy), single(at.yy), at.across, at.down, places, rays, size_.width,
                            size_.height, columns, rows, first, band);
        },
        [&](const Buffer& picture, const Buffer& places, int first, int band) {
            device_->launch(kernel("show_plane"), range_of(columns, band), Grain::fine, planes_of_pixels_,
                            uploaded, places, at.across * at.down, single(view.light[2]), picture,
                            size_.width, size_.height, columns, rows, first, band);
        });
    const std::lock_guard lock(mutex_);
    met_ = std::move(met);
    return image;
}

Image LitShape::sphere(const BtfScene& scene, const LitView& view, const LitTable& table) const {
    const auto radian = static_cast<float>(texels_of_radian(scene, size_.width));
    const auto radius = static_cast<float>(sphere_radius(scene.size));
    const Float4 right = float4(view.camera.right), up = float4(view.camera.up), to = float4(view.camera.to),
                 light = float4(view.light);
    const int samples = most_samples * most_samples, columns = scene.size.width, rows = scene.size.height;
    const Buffer uploaded = upload(table);
    std::shared_ptr<const Buffer> met;  // depends on the light, too
    return picture(
        scene.size, samples, met,
        [&](const Buffer& places, const Buffer& rays, int first, int band) {
            device_->launch(device_->kernel("lit_shape", "place_sphere", BuildParameters()),
                            range_of(columns, band), Grain::fine, right, up, to, light, radius, radian,
                            static_cast<float>(std::cos(view.steepest_view)),
                            static_cast<float>(std::sin(view.steepest_view)), places, rays, size_.width,
                            size_.height, columns, rows, first, band);
        },
        [&](const Buffer& picture, const Buffer& places, int first, int band) {
            device_->launch(kernel("show_sphere"), range_of(columns, band), Grain::fine, planes_of_pixels_,
                            uploaded, places, table.longitudes, table.latitudes, right, up, to, light, radius,
                            picture, size_.width, size_.height, columns, rows, first, band);
        });
}

}  // namespace btfield::detail
