#include "host/rendering/shape_places.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace btfield::detail {
namespace {

/// As far as the rim of a sphere is looked at, in radii.
constexpr double rim = 0.9999;

/// The texel in the middle of a picture's axis: that of the tile, or the nearest by which pixels 1:1 are
/// texels.
double middle(int picture, int tile) {
    const double own = 0.5 * (picture - 1);
    return own - std::floor(own - 0.5 * (tile - 1) + 0.5);
}

}  // namespace

int samples_of(double texels) {
    return std::clamp(static_cast<int>(std::ceil(static_cast<float>(texels) - 0.01F)), 1, most_samples);
}

PlanePlaces plane_places(const BtfScene& scene, const CameraFrame& camera, Size tile) {
    const Vector3& to = camera.to;
    // A place of the plane lies 1 / cos theta as far along the view as in the picture.
    const double more = 1.0 / (to[2] * (1.0 + to[2])), scale = 1.0 / scene.scale;
    PlanePlaces places;
    places.x = middle(scene.size.width, tile.width);
    places.y = middle(scene.size.height, tile.height);
    places.xx = scale * (1.0 + more * to[0] * to[0]);
    places.xy = scale * more * to[0] * to[1];
    places.yy = scale * (1.0 + more * to[1] * to[1]);
    places.across = samples_of(std::hypot(places.xx, places.xy));
    places.down = samples_of(std::hypot(places.xy, places.yy));
    return places;
}

double sphere_radius(Size picture) {
    return 0.45 * std::min(picture.width, picture.height);
}

double texels_of_radian(const BtfScene& scene, int tile_width) {
    return tiles_around(scene, tile_width) * static_cast<double>(tile_width) / (2.0 * std::numbers::pi);
}

double SpherePoint::longitude() const {
    return std::atan2(normal[0], normal[2]);
}

double SpherePoint::latitude() const {
    return std::asin(std::clamp(normal[1], -1.0, 1.0));
}

SpherePoint sphere_point(double right, double up, const CameraFrame& camera) {
    const double out = std::hypot(right, up), within = out > rim ? rim / out : 1.0;
    SpherePoint point;
    point.right = right * within;
    point.up = up * within;
    point.to = std::sqrt(1.0 - point.right * point.right - point.up * point.up);
    for (std::size_t i = 0; i < 3; ++i)
        point.normal[i] = camera.right[i] * point.right + camera.up[i] * point.up + camera.to[i] * point.to;
    return point;
}

SampleCount sphere_samples(const SpherePoint& middle, double density) {
    const double level = std::sqrt(std::max(1.0 - middle.normal[1] * middle.normal[1], 0.0)),
                 dense = density / std::max(level, 0.25);
    return {samples_of(dense * std::hypot(1.0, middle.right / middle.to)),
            samples_of(dense * std::hypot(1.0, middle.up / middle.to))};
}

double sphere_coverage(double distance, double radius) {
    return std::clamp(radius + 0.5 - distance, 0.0, 1.0);
}

PicturePlace pixel_place(int column, int row, Size picture) {
    return {column - 0.5 * (picture.width - 1), 0.5 * (picture.height - 1) - row};
}

PicturePlace sample_place(int index, int across, int down) {
    const int row = index / across, column = index % across;
    return {(column + 0.5) / across - 0.5, (row + 0.5) / down - 0.5};
}

}  // namespace btfield::detail
