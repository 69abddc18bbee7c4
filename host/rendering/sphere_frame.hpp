#pragma once

// Where a camera stands, and the frames of places on a sphere (theory 23.1).

#include <array>

#include "btfield/btf_set.hpp"

namespace btfield::detail {

using Vector3 = std::array<double, 3>;

[[nodiscard]] double dot(const Vector3& a, const Vector3& b);

/// What is right and up in a picture from a view: those of the picture from above, turned with the camera,
/// which goes to the view the shortest way.
struct CameraFrame {
    Vector3 right, up, to;
};
[[nodiscard]] CameraFrame camera_frame(const BtfDirection& view);

/// Frame of a place on a sphere with poles at ±y: x along increasing longitude, which goes from z towards x,
/// y along increasing latitude, z outwards.
struct PlaceFrame {
    Vector3 east, north, out;
};
[[nodiscard]] PlaceFrame place_frame(double longitude, double latitude);

/// A direction as a frame has it. Those behind, or lower than `steepest`, are at `steepest` and keep phi.
[[nodiscard]] BtfDirection seen_from(const PlaceFrame& frame, const Vector3& direction, double steepest);

}  // namespace btfield::detail
