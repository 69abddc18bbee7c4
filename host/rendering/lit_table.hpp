#pragma once

// Tables of a shape: what is known of the directions at each of its places (theory 23.1).

#include <cstddef>
#include <vector>

#include "btfield/btf_set.hpp"
#include "host/btf/direction_table.hpp"
#include "host/rendering/lit_shape.hpp"

namespace btfield::detail {

/// What the directions have, the mean over l_z: that of the outermost ring beyond it.
[[nodiscard]] PictureWeights lit_weights(const DirectionTable& table, const BtfDirection& view,
                                         const BtfDirection& light);

/// Without the planes behind the first.
[[nodiscard]] PictureWeights first_planes(PictureWeights weights, std::size_t planes);

/// Longitudes, and latitudes with both poles: steps of 7.5 degrees.
inline constexpr int sphere_longitudes = 48, sphere_latitudes = 25;

/// Of [latitude][longitude], and what is seen and lit there, in the frame of the place.
struct SpherePlace {
    std::size_t index = 0;
    BtfDirection view, light;
};
/// Places of a sphere that camera and light reach, or that lie beside those.
/// \param camera, light  unit vectors in the sphere's frame
[[nodiscard]] std::vector<SpherePlace> sphere_places(const Vector3& camera, const Vector3& light);

/// Entries at the places of a sphere that camera and light reach, or that lie beside those.
/// \param camera, light  unit vectors in the sphere's frame
[[nodiscard]] LitTable sphere_table(const DirectionTable& table, const Vector3& camera, const Vector3& light);

}  // namespace btfield::detail
