#pragma once

/// \file
/// The Karhunen-Loève transform of the planes (theory 3; P4 2, "2D" models).

#include <span>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/image.hpp"
#include "btfield/lag_covariance.hpp"

namespace btfield {

/// Orthonormal basis of the spectral directions in which a picture varies: eigenplanes m = T (y − μ) and
/// back, y = Tᵀ m + μ. Eigenplanes have mean 0, no correlation at lag 0, and descending variance.
struct SpectralBasis {
    int planes = 0;  ///< d, of the picture
    /// r <= d, of the eigenplanes. Smaller than d where planes repeat each other, are combinations of others
    /// or are constant (a grey picture stored as RGB: 1): directions without variance have no eigenplane, and
    /// come back with the mean alone.
    int rank = 0;
    std::vector<double> matrix;  ///< T, r × d row-major; rows are orthonormal eigenvectors of the covariance
    std::vector<double> mean;    ///< μ, d values
};

/// Directions of less than this part of the largest variance, 10⁻⁴ of its deviation, count as constant: no
/// 8-bit picture shows them, and what they hold is the rounding of planes that repeat each other, or a stray
/// pixel.
inline constexpr double smallest_relative_variance = 1e-8;

/// The basis of a picture, in float64: T diagonalises Σ_Y = E[(Y − μ)(Y − μ)ᵀ]. Each eigenvector's component
/// of largest magnitude is positive, the first of equals, so that a fit is reproducible.
/// \throws InputError when the picture is empty, constant, or holds a NaN or infinity
[[nodiscard]] BTFIELD_API SpectralBasis spectral_basis(const Image& image);

/// T (Y − μ), float64 arithmetic stored as float32: r eigenplanes, colour space `unspecified`.
/// \throws InputError when the numbers of planes differ
[[nodiscard]] BTFIELD_API Image to_eigenplanes(const SpectralBasis& basis, const Image& image);

/// Tᵀ M + μ, the reverse: d planes of this colour space. Gives the picture back to float rounding.
/// \throws InputError when the picture has not r planes
[[nodiscard]] BTFIELD_API Image from_eigenplanes(const SpectralBasis& basis, const Image& eigenplanes,
                                                 ColourSpace space);

/// T C(s) Tᵀ at every lag: the statistic of the eigenplanes from that of the picture (theory 5.3).
/// \throws InputError when the numbers of planes differ
[[nodiscard]] BTFIELD_API LagCovariance turned(const SpectralBasis& basis, const LagCovariance& statistic);

/// Tᵀ C(s) T of covariances [lag][i][j], r × r a lag → d × d a lag: those of the picture from those of its
/// eigenplanes.
/// \throws InputError when the number of values is not a multiple of r²
[[nodiscard]] BTFIELD_API std::vector<double> turned_back(const SpectralBasis& basis,
                                                          std::span<const double> covariances);

/// \throws InputError naming the first defect: sizes that disagree, numbers that are not finite, rows that
///     are not orthonormal to 1e-9
BTFIELD_API void check(const SpectralBasis& basis);

}  // namespace btfield
