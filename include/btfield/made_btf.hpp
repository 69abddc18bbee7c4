#pragma once

/// \file
/// BTFs of materials that maps tell: for those who have maps and no goniometer, and as truth for tests.

#include <vector>

#include "btfield/api.hpp"
#include "btfield/btf_set.hpp"
#include "btfield/device.hpp"
#include "btfield/image.hpp"

namespace btfield {

/// Maps of one surface, pixel by pixel, which tiles.
struct BtfMaterial {
    Image albedo;     ///< linear, 0 to 1, any number of planes
    Image normals;    ///< unit vectors, x right, y up, z away from the surface
    Image height;     ///< one plane, in pixels
    Image roughness;  ///< one plane, 0 to 1; empty: MadeBtfOptions::roughness everywhere
};

struct MadeBtfOptions {
    std::vector<BtfDirection> views = btf_directions_81(), lights = btf_directions_81();
    double roughness = 0.45;    ///< of the lobe: its α is the square of this
    double reflectance = 0.04;  ///< of the lobe; 0: matt
};

/// Pictures of the surface, computed when they are asked for: a ray to the viewer is followed to what it
/// hits, light is where nothing stands in its way, with soft edges; reflected are Lambert's part and a lobe
/// of GGX (docs/btf.md). A white, matt, level surface under a light along its normal is 1. The height of the
/// description is the material's, its mean taken away; its format is "made". Pictures are the same to 1e-4 of
/// white on any device, but for pixels whose rays graze an edge.
/// \param device  outlives the set
/// \throws InputError when maps differ in size or have other planes, a value is not finite, roughness or
///     reflectance is not in [0, 1], there is no view or light, or one is not above the surface
[[nodiscard]] BTFIELD_API BtfSet make_btf(Device& device, const BtfMaterial& material,
                                          const MadeBtfOptions& options = {});

}  // namespace btfield
