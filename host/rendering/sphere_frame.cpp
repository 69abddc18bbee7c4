#include "host/rendering/sphere_frame.hpp"

#include <algorithm>
#include <cmath>

namespace btfield::detail {

double dot(const Vector3& a, const Vector3& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

CameraFrame camera_frame(const BtfDirection& view) {
    const Vector3 to = view.vector();
    const double x = to[0] / (1.0 + to[2]), y = to[1] / (1.0 + to[2]);
    return {{1.0 - x * to[0], -x * to[1], -to[0]}, {-x * to[1], 1.0 - y * to[1], -to[1]}, to};
}

PlaceFrame place_frame(double longitude, double latitude) {
    const double sine = std::sin(longitude), cosine = std::cos(longitude), level = std::cos(latitude),
                 north = std::sin(latitude);
    return {
        {cosine, 0.0, -sine}, {-sine * north, level, -cosine * north}, {sine * level, north, cosine * level}};
}

BtfDirection seen_from(const PlaceFrame& frame, const Vector3& direction, double steepest) {
    const double x = dot(frame.east, direction), y = dot(frame.north, direction),
                 z = dot(frame.out, direction);
    return {std::min(std::atan2(std::hypot(x, y), z), steepest), std::atan2(y, x)};
}

}  // namespace btfield::detail
