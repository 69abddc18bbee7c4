#pragma once

// Lights around a surface, and what it looks like under them.

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "btfield/height.hpp"
#include "btfield/image_io.hpp"

namespace btfield::test {

using Direction = std::array<double, 3>;

/// Unit vectors on rings about the normal of the surface.
inline std::vector<Direction> dome(int count) {
    std::vector<Direction> lights;
    for (int k = 0; k < count; ++k) {
        const double theta = (15.0 + 45.0 * ((k * 7) % count) / count) / 180.0 * std::numbers::pi;
        const double phi = 2.0 * std::numbers::pi * k * 0.381966;
        lights.push_back({std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)});
    }
    return lights;
}

/// Hills of moderate slopes.
inline Image hilly_normals(Size size) {
    Image height(size, 1);
    for (int r = 0; r < size.height; ++r)
        for (int c = 0; c < size.width; ++c)
            height.at(0, r, c) =
                static_cast<float>(2.0 * std::sin(0.21 * c + 0.1 * r) + 1.5 * std::cos(0.17 * r - 0.05 * c));
    return normals_of_slopes(slopes_of_height(height, SurfaceEdges::mirror));
}

/// Albedo of plane p at a pixel.
inline float albedo_at(int p, int r, int c) {
    return 0.3F + 0.1F * static_cast<float>(p) + 0.02F * static_cast<float>((r + 2 * c) % 5);
}

struct Light {
    Direction direction{};
    float ambient = 0.0F;
    float noise = 0.0F;    ///< standard deviation, relative
    float shadows = 0.0F;  ///< share of pixels that are dark although they face the light
    float gloss = 0.0F;    ///< strength of a lobe of roughness 0.3
};

/// What is seen under a light.
inline Image lit(const Image& normals, int planes, const Light& light, unsigned seed) {
    std::mt19937 generator(seed);
    std::normal_distribution<float> normal;
    std::uniform_real_distribution<float> uniform;
    const Direction& l = light.direction;
    const double half = std::hypot(l[0], l[1], l[2] + 1.0);
    Image image(normals.size(), planes, ColourSpace::linear);
    for (int r = 0; r < image.height(); ++r)
        for (int c = 0; c < image.width(); ++c) {
            const double x = normals.at(0, r, c), y = normals.at(1, r, c), z = normals.at(2, r, c);
            double shade = std::max(0.0, x * l[0] + y * l[1] + z * l[2]);
            const double cosine = (x * l[0] + y * l[1] + z * (l[2] + 1.0)) / half;
            const double root = 0.09 / (cosine * cosine * (0.09 - 1.0) + 1.0);
            if (uniform(generator) < light.shadows) shade = 0.0;
            for (int p = 0; p < planes; ++p) {
                const double value =
                    albedo_at(p, r, c) * (shade + static_cast<double>(light.ambient)) +
                    static_cast<double>(light.gloss) * root * root * std::min(1.0, 10.0 * shade);
                image.at(p, r, c) = static_cast<float>(value) * (1.0F + light.noise * normal(generator));
            }
        }
    return image;
}

/// Pictures of a hilly surface as files, linear, and dirs.lp beside them.
inline std::vector<Direction> put_lights(const std::filesystem::path& folder, Size size, int count,
                                         int planes, PixelType type, const std::string& extension,
                                         const Light& like = {}) {
    std::filesystem::create_directories(folder);
    const Image normals = hilly_normals(size);
    const std::vector<Direction> lights = dome(count);
    std::ofstream table(folder / "dirs.lp");
    table << count << "\n";
    for (int k = 0; k < count; ++k) {
        Light light = like;
        light.direction = lights[static_cast<std::size_t>(k)];
        WriteOptions how;
        how.source = how.type.emplace(type);
        how.keep_values = true;
        const std::string name = "light " + std::to_string(k) + extension;
        write_picture(folder / name, lit(normals, planes, light, static_cast<unsigned>(k)), how);
        table << name << " " << light.direction[0] << " " << light.direction[1] << " " << light.direction[2]
              << "\n";
    }
    return lights;
}

/// Mean angle between two fields of normals, in degrees.
inline double mean_angle(const Image& a, const Image& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < area(a.size()); ++i) {
        double cosine = 0.0;
        for (int p = 0; p < 3; ++p)
            cosine += static_cast<double>(a.plane(p)[i]) * static_cast<double>(b.plane(p)[i]);
        sum += std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi;
    }
    return sum / static_cast<double>(area(a.size()));
}

}  // namespace btfield::test
