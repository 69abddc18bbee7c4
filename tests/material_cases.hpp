#pragma once

// Maps of one material as files, registered.

#include <filesystem>
#include <string>

#include "btfield/height.hpp"
#include "btfield/image_io.hpp"
#include "tests/device_cases.hpp"

namespace btfield::test {

inline void put_map(const std::filesystem::path& path, const Image& image, PixelType type) {
    WriteOptions how;
    how.type = type;
    how.keep_values = true;
    write_picture(path, image, how);
}

/// s_albedo.png, s_normal.png (green up) and s_height.png of 16 bits, 64 × 64. Heights are from −4 to 4
/// pixels or so, 16 pixels between black and white.
inline void put_material(const std::filesystem::path& folder) {
    const Image noise = mixed_texture({64, 64}, 4, 3);
    Image colour({64, 64}, 3, ColourSpace::srgb), height({64, 64}, 1);
    for (std::size_t i = 0; i < area(height.size()); ++i) {
        height.plane(0)[i] = noise.plane(3)[i];
        for (int p = 0; p < 3; ++p) colour.plane(p)[i] = 0.4F + 0.05F * noise.plane(p)[i];
    }
    const Image normals = normals_of_slopes(slopes_of_height(height, SurfaceEdges::mirror));
    put_map(folder / "s_albedo.png", colour, PixelType::uint16);
    put_map(folder / "s_normal.png", encode_normals(normals), PixelType::uint16);
    put_map(folder / "s_height.png", encode_height(height, 16.0), PixelType::uint16);
}

/// s_roughness.png, s_metalness.png, s_ao.png and s_opacity.png of 8 bits beside these.
inline void put_scalar_maps(const std::filesystem::path& folder) {
    const Image noise = mixed_texture({64, 64}, 4, 5);
    int p = 0;
    for (const char* name : {"s_roughness.png", "s_metalness.png", "s_ao.png", "s_opacity.png"}) {
        Image map({64, 64}, 1);
        for (std::size_t i = 0; i < area(map.size()); ++i)
            map.plane(0)[i] = 0.3F + 0.1F * static_cast<float>(p) + 0.04F * noise.plane(p)[i];
        put_map(folder / name, map, PixelType::uint8);
        ++p;
    }
}

}  // namespace btfield::test
