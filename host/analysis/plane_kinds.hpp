#pragma once

// Planes that are measured in one unit, and those that are not (theory 3).

#include <span>
#include <vector>

#include "btfield/image.hpp"
#include "btfield/spectral_basis.hpp"

namespace btfield::detail {

/// A number per plane, less than the number of planes, equal where planes are of one kind: colours of a
/// picture, those that their names make colours of one layer, wavelengths. They may be compared as they are.
/// Of all other planes nothing is known that would let a height in metres be compared with a roughness.
[[nodiscard]] std::vector<int> plane_kinds(const Image& image);

/// What each plane is divided by where planes of unlike kinds meet: the root of the mean variance of its
/// kind, 1 where that does not vary. Empty where all planes are of one kind: they stay as they are.
/// \param variances of the planes; 0 of those that are constant
[[nodiscard]] std::vector<double> kind_deviations(const Image& image, std::span<const double> variances);

/// T D, r × d row-major: y_j − μ_j = Σ_i (T D)_{i,j} m_i.
[[nodiscard]] std::vector<double> scaled_matrix(const SpectralBasis& basis);

}  // namespace btfield::detail
