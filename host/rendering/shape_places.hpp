#pragma once

// Which places of the material pixels of a shape show (theory 23.1). The kernels of lit_shape.cl have the
// same.

#include "btfield/btf_renderer.hpp"
#include "btfield/image.hpp"
#include "host/rendering/sphere_frame.hpp"

namespace btfield::detail {

/// Of a pixel along each axis at most: samples are [down][across] of these.
inline constexpr int most_samples = 4;
[[nodiscard]] int samples_of(double texels);

/// Texels (x, y) of a pixel (right, up) of the picture's middle: (x + xx right + xy up,
/// y − xy right − yy up).
struct PlanePlaces {
    double x = 0.0, y = 0.0, xx = 1.0, xy = 0.0, yy = 1.0;
    int across = 1, down = 1;  ///< samples
};
[[nodiscard]] PlanePlaces plane_places(const BtfScene& scene, const CameraFrame& camera, Size tile);

/// Pixels of the sphere's radius.
[[nodiscard]] double sphere_radius(Size picture);
/// Texels of a radian.
[[nodiscard]] double texels_of_radian(const BtfScene& scene, int tile_width);

/// What a pixel's middle, or one of its samples, has of a sphere.
struct SpherePoint {
    Vector3 normal{};                        ///< in the sphere's frame, poles at ±y
    double right = 0.0, up = 0.0, to = 0.0;  ///< the same in the camera's
    [[nodiscard]] double longitude() const;
    [[nodiscard]] double latitude() const;
};
/// \param right, up  in radii; beyond the rim the point is at it
[[nodiscard]] SpherePoint sphere_point(double right, double up, const CameraFrame& camera);

/// Samples of a sphere's pixel, across and down.
struct SampleCount {
    int across = 1, down = 1;
};
/// \param density  texels of a pixel where it faces the camera, on the equator
[[nodiscard]] SampleCount sphere_samples(const SpherePoint& middle, double density);

/// Share of a pixel, of its distance from the middle in pixels, that a sphere covers.
[[nodiscard]] double sphere_coverage(double distance, double radius);

/// (right, up) of a pixel from the middle of a picture, and of one of its samples from there.
struct PicturePlace {
    double right = 0.0, up = 0.0;
};
[[nodiscard]] PicturePlace pixel_place(int column, int row, Size picture);
[[nodiscard]] PicturePlace sample_place(int index, int across, int down);

}  // namespace btfield::detail
