#pragma once

// Pixels of a material on a plane or a sphere in float64 (theory 23.1).

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "host/rendering/lit_shape.hpp"
#include "tests/reference/made_btf.hpp"

namespace btfield::reference {

using detail::Vector3;

struct Entry {
    std::vector<double> log_mean, offsets, weights;
};

inline Entry entry_of(const detail::PictureWeights& weights) {
    Entry entry{weights.mean, weights.offsets, weights.weights};
    for (double& mean : entry.log_mean) mean = std::log(mean);
    return entry;
}

inline void add(Entry& sum, double share, const Entry& other) {
    for (std::size_t i = 0; i < other.log_mean.size(); ++i) sum.log_mean[i] += share * other.log_mean[i];
    for (std::size_t i = 0; i < other.offsets.size(); ++i) sum.offsets[i] += share * other.offsets[i];
    for (std::size_t i = 0; i < other.weights.size(); ++i) sum.weights[i] += share * other.weights[i];
}

/// z² of each colour where a ray through (x, y) of the mean plane first meets the relief, from above, found
/// in steps of 1/200 of a texel.
inline std::vector<double> squares(const Image& surface, double x, double y, const Vector3& ray,
                                   const Entry& entry) {
    const auto [low, high] = std::ranges::minmax(surface.plane(0));
    double t = static_cast<double>(high) / ray[2];
    while (t > static_cast<double>(low) / ray[2] &&
           ray[2] * t > between(surface, 0, x + ray[0] * t, y - ray[1] * t))
        t -= 0.005;
    std::vector<double> result;
    const std::size_t planes = static_cast<std::size_t>(surface.planes() - 1);
    for (std::size_t c = 0; c < entry.offsets.size(); ++c) {
        double z = entry.offsets[c];
        for (std::size_t k = 0; k < planes; ++k)
            z += entry.weights[c * planes + k] *
                 between(surface, static_cast<int>(k) + 1, x + ray[0] * t, y - ray[1] * t);
        result.push_back(z > 0.0 ? z * z : 0.0);
    }
    return result;
}

inline int samples(double texels) {
    return std::clamp(static_cast<int>(std::ceil(texels - 0.01)), 1, 4);
}

/// Mean over samples of a pixel; `show(right, up)` has its squares at an offset from the pixel's middle.
template <class Show>
std::vector<double> averaged(int across, int down, const Show& show) {
    std::vector<double> sum;
    for (int j = 0; j < down; ++j)
        for (int i = 0; i < across; ++i) {
            const std::vector<double> one = show((i + 0.5) / across - 0.5, (j + 0.5) / down - 0.5);
            sum.resize(one.size());
            for (std::size_t c = 0; c < one.size(); ++c) sum[c] += one[c] / (across * down);
        }
    return sum;
}

/// A pixel of a plane. What the picture foreshortens along the view's phi, the plane has at full length.
inline std::vector<double> plane_pixel(const Image& surface, const BtfScene& scene, const BtfDirection& view,
                                       const Vector3& light, const detail::PictureWeights& weights, int row,
                                       int column) {
    const Vector3 to = view.vector();
    const double ex = std::cos(view.phi), ey = std::sin(view.phi), longer = 1.0 / std::cos(view.theta) - 1.0;
    const auto place = [&](double right, double up) {
        const double along = right * ex + up * ey;
        return std::array{(right + longer * along * ex) / scene.scale,
                          (up + longer * along * ey) / scene.scale};
    };
    const auto middle = [](int picture, int tile) {  // whole texels from that of the tile
        double at = 0.5 * (picture - 1);
        while (at >= 0.5 * (tile - 1) + 0.5) at -= 1.0;
        while (at < 0.5 * (tile - 1) - 0.5) at += 1.0;
        return at;
    };
    const Entry entry = entry_of(weights);
    const auto step_x = place(1.0, 0.0), step_y = place(0.0, 1.0);
    std::vector<double> pixel =
        averaged(samples(std::hypot(step_x[0], step_x[1])), samples(std::hypot(step_y[0], step_y[1])),
                 [&](double right, double up) {
                     const auto at = place(column - 0.5 * (scene.size.width - 1) + right,
                                           0.5 * (scene.size.height - 1) - row + up);
                     return squares(surface, middle(scene.size.width, surface.width()) + at[0],
                                    middle(scene.size.height, surface.height()) - at[1], to, entry);
                 });
    for (std::size_t c = 0; c < pixel.size(); ++c) pixel[c] *= weights.mean[c] * light[2];
    return pixel;
}

/// A pixel of a sphere.
inline std::vector<double> sphere_pixel(const Image& surface, const BtfScene& scene,
                                        const detail::LitView& view, const detail::LitTable& table, int row,
                                        int column) {
    const double radius = 0.45 * std::min(scene.size.width, scene.size.height);
    const double right = column - 0.5 * (scene.size.width - 1), up = 0.5 * (scene.size.height - 1) - row;
    const auto normal = [&](double x, double y) {
        const double out = std::hypot(x, y) / radius, within = out > 0.9999 ? 0.9999 / out : 1.0;
        const double a = x * within / radius, b = y * within / radius, c = std::sqrt(1.0 - a * a - b * b);
        Vector3 n{};
        for (std::size_t i = 0; i < 3; ++i)
            n[i] = a * view.camera.right[i] + b * view.camera.up[i] + c * view.camera.to[i];
        return n;
    };
    const auto angles = [](const Vector3& n) {
        return std::array{std::atan2(n[0], n[2]), std::asin(std::clamp(n[1], -1.0, 1.0))};
    };
    const double coverage = std::clamp(radius + 0.5 - std::hypot(right, up), 0.0, 1.0);
    const Vector3 n = normal(right, up);
    const double lit = detail::dot(n, view.light);
    std::vector<double> pixel;
    for (const double grey : table.background) pixel.push_back((1.0 - coverage) * grey);
    if (coverage == 0.0 || lit <= 0.0) return pixel;

    const auto place = angles(n);
    const double longitude = place[0], latitude = place[1];
    const double turn = longitude / (2.0 * std::numbers::pi),
                 around = (turn - std::floor(turn)) * table.longitudes,
                 over = (latitude / std::numbers::pi + 0.5) * (table.latitudes - 1);
    Entry entry = entry_of(table.entries.front());
    for (auto* part : {&entry.log_mean, &entry.offsets, &entry.weights}) std::ranges::fill(*part, 0.0);
    for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 2; ++i) {
            const int west = static_cast<int>(around),
                      south = std::min(static_cast<int>(over), table.latitudes - 2);
            const double share =
                (i == 0 ? west + 1 - around : around - west) * (j == 0 ? south + 1 - over : over - south);
            const auto index =
                static_cast<std::size_t>((south + j) * table.longitudes + (west + i) % table.longitudes);
            add(entry, share, entry_of(table.entries[index]));
        }
    const detail::PlaceFrame frame = detail::place_frame(longitude, latitude);
    const Vector3 ray = detail::seen_from(frame, view.camera.to, view.steepest_view).vector();

    const double radian = tiles_around(scene, surface.width()) * surface.width() / (2.0 * std::numbers::pi);
    const double z = detail::dot(n, view.camera.to);
    const auto stretch = [&](const Vector3& axis) {
        const double slope = detail::dot(n, axis) / z;
        return radian / (radius * std::max(std::cos(latitude), 0.25)) * std::sqrt(1.0 + slope * slope);
    };
    const std::vector<double> mean = averaged(
        samples(stretch(view.camera.right)), samples(stretch(view.camera.up)), [&](double x, double y) {
            const auto [east, north] = angles(normal(right + x, up + y));
            return squares(surface, 0.5 * (surface.width() - 1) + radian * east,
                           0.5 * (surface.height() - 1) - radian * north, ray, entry);
        });
    for (std::size_t c = 0; c < pixel.size(); ++c)
        pixel[c] += coverage * std::exp(entry.log_mean[c]) * lit * mean[c];
    return pixel;
}

}  // namespace btfield::reference
