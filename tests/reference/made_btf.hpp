#pragma once

// One pixel of a made BTF in float64, as docs/btf.md has it.

#include <algorithm>
#include <array>
#include <cmath>

#include "btfield/made_btf.hpp"

namespace btfield::reference {

/// A map between pixels, on the torus.
inline double between(const Image& map, int plane, double x, double y) {
    const auto wrap = [](double a, int n) { return static_cast<int>(a - n * std::floor(a / n)) % n; };
    const double left = std::floor(x), top = std::floor(y);
    const int x0 = wrap(left, map.width()), x1 = (x0 + 1) % map.width();
    const int y0 = wrap(top, map.height()), y1 = (y0 + 1) % map.height();
    const auto at = [&](int r, int c) { return static_cast<double>(map.at(plane, r, c)); };
    return (at(y0, x0) * (left + 1.0 - x) + at(y0, x1) * (x - left)) * (top + 1.0 - y) +
           (at(y1, x0) * (left + 1.0 - x) + at(y1, x1) * (x - left)) * (y - top);
}

struct Place {
    double x = 0.0, y = 0.0;
};

/// What the viewer sees at a pixel: the first point of the surface from above, to 1/1000 of a pixel. Looks at
/// every hundredth of a pixel: it misses no edge.
inline Place seen_at(const Image& height, int row, int column, const std::array<double, 3>& view) {
    const auto [low, high] = std::ranges::minmax(height.values());
    double t = static_cast<double>(high) / view[2];
    const auto above = [&](double at) {
        return view[2] * at > between(height, 0, column + view[0] * at, row - view[1] * at);
    };
    while (above(t) && t > static_cast<double>(low) / view[2]) t -= 0.01;
    return {column + view[0] * (t + 0.005), row - view[1] * (t + 0.005)};
}

/// Share of a light that reaches a pixel of the surface.
inline double lit(const Image& height, int row, int column, const std::array<double, 3>& light) {
    const auto high = static_cast<double>(std::ranges::max(height.values()));
    double clearance = 0.5;
    for (int i = 0;; ++i) {
        const double t = 1.0 + 0.7 * i, ray = static_cast<double>(height.at(0, row, column)) + light[2] * t;
        if (t > 3.0 * std::max(height.width(), height.height()) || ray > high + 0.075 * t) break;
        const double below = between(height, 0, column + light[0] * t, row - light[1] * t);
        clearance = std::min(clearance, (ray - below) / (0.15 * t));
    }
    return std::max(clearance + 0.5, 0.0);
}

/// Lambert's part and the lobe of one plane, where a share of the light arrives.
inline double reflected(double albedo, std::array<double, 3> n, const std::array<double, 3>& view,
                        const std::array<double, 3>& light, double roughness, double reflectance) {
    const auto dot = [](const auto& a, const auto& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
    const double length = std::sqrt(dot(n, n));
    for (double& x : n) x /= length;
    std::array<double, 3> h{view[0] + light[0], view[1] + light[1], view[2] + light[2]};
    const double half_length = std::sqrt(dot(h, h));
    const double nl = std::max(dot(n, light), 0.0), nv = std::max(dot(n, view), 0.05);
    const double nh = std::clamp(dot(n, h) / half_length, 0.0, 1.0);
    const double a2 = std::pow(roughness, 4), k = roughness * roughness / 2.0;
    // π times the radiance of a light of irradiance 1 across its rays.
    const double distribution = a2 / std::pow(nh * nh * (a2 - 1.0) + 1.0, 2);
    const double masking = 1.0 / (4.0 * (nv * (1.0 - k) + k) * (std::max(nl, 0.02) * (1.0 - k) + k));
    return (albedo + distribution * masking * reflectance) * nl;
}

}  // namespace btfield::reference
