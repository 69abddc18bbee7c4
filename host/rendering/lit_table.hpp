#pragma once

// Tables of a shape: what is known of the directions at each of its places (theory 23.1).

#include <cstddef>

#include "btfield/btf_set.hpp"
#include "host/btf/direction_table.hpp"
#include "host/rendering/lit_shape.hpp"

namespace btfield::detail {

/// What the directions have, the mean over l_z: that of the outermost ring beyond it.
[[nodiscard]] PictureWeights lit_weights(const DirectionTable& table, const BtfDirection& view,
                                         const BtfDirection& light);

/// Without the planes behind the first.
[[nodiscard]] PictureWeights first_planes(PictureWeights weights, std::size_t planes);

/// Entries at the places of a sphere that camera and light reach, or that lie beside those.
/// \param camera, light  unit vectors in the sphere's frame
[[nodiscard]] LitTable sphere_table(const DirectionTable& table, const Vector3& camera, const Vector3& light);

}  // namespace btfield::detail
