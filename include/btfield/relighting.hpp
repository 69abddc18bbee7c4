#pragma once

/// \file
/// A surface under a light that it has not been seen under (theory 19.5).

#include <array>
#include <filesystem>
#include <optional>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/height.hpp"
#include "btfield/image.hpp"
#include "btfield/image_io.hpp"
#include "btfield/light_set.hpp"
#include "btfield/relief.hpp"

namespace btfield {

/// Maps of one surface, pixel by pixel.
struct Surface {
    Image normals;  ///< unit vectors
    Image albedo;   ///< linear, any number of planes
    Image height;   ///< in pixels; empty: nothing throws shadows
    SurfaceEdges edges = SurfaceEdges::mirror;
};

/// To a light that is theta degrees from the normal of the plane, phi counter-clockwise from the right.
[[nodiscard]] BTFIELD_API std::array<double, 3> direction_of_angles(double theta, double phi);

/// Albedo times n·l, where no higher part of the surface is in the way; edges of shadows are as soft as a
/// lamp 3 degrees across makes them. Shadows wrap on the torus, and end at mirrors.
/// \param light  of any length, z above 0
/// \throws InputError when sizes or planes do not fit, or the light is behind
[[nodiscard]] BTFIELD_API Image relight(const Surface& surface, const std::array<double, 3>& light);

struct LightScore {
    std::filesystem::path picture;
    double error = 0.0;  ///< Σ |I − relit| / Σ I, both averaged over planes
};

/// How well the surface tells pictures under lights, best of such that it was not made of.
/// \param coding  of the pictures' numbers: linear, srgb, or gamma; automatic is linear
/// \param crop  of the pictures, of the surface's size
/// \throws InputError when sizes or planes differ, or what read_picture() refuses
[[nodiscard]] BTFIELD_API std::vector<LightScore> score_lights(const Surface& surface, const LightSet& lights,
                                                               LightCoding coding, double gamma = 2.2,
                                                               std::optional<Crop> crop = {});

}  // namespace btfield
