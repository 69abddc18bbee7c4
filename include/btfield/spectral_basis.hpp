#pragma once

/// \file
/// The Karhunen-Loève transform of the planes (theory 3; P4 2, "2D" models).

#include <span>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/image.hpp"
#include "btfield/lag_covariance.hpp"

namespace btfield {

/// Orthonormal basis of the spectral directions in which a picture varies: eigenplanes m = T D⁻¹ (y − μ) and
/// back, y = D Tᵀ m + μ. Eigenplanes have mean 0, no correlation at lag 0, and descending variance. D,
/// diagonal, takes the units away where planes are of unlike kinds; colours of a picture are of one, and D =
/// 1.
struct SpectralBasis {
    int planes = 0;  ///< d, of the picture
    /// r <= d, of the eigenplanes. Smaller than d where planes repeat each other, are combinations of others
    /// or are constant (a grey picture stored as RGB: 1): directions without variance have no eigenplane, and
    /// come back with the mean alone.
    int rank = 0;
    std::vector<double> matrix;  ///< T, r × d row-major; rows are orthonormal eigenvectors of the covariance
    std::vector<double> mean;    ///< μ, d values
    std::vector<double> scale{};  ///< diagonal of D, d positive values; empty: all are 1
};

/// Directions (of planes of one kind, or divided by their kind's deviation) of less than this part of the
/// largest variance, 10⁻⁴ of its deviation, count as constant: no 8-bit picture shows them, and what they
/// hold is the rounding of planes that repeat each other, or a stray pixel.
inline constexpr double smallest_relative_variance = 1e-8;

/// The basis of a picture, in float64: T diagonalises D⁻¹ Σ_Y D⁻¹, Σ_Y = E[(Y − μ)(Y − μ)ᵀ]. Planes of a
/// picture with a colour space are of one kind, and those whose names say so; all others are each of their
/// own, and D holds the deviations of kinds (the root of the mean variance of the planes of a kind). Each
/// eigenvector's component of largest magnitude is positive, the first of equals, so that a fit is
/// reproducible.
/// \throws InputError when the picture is empty, constant, or holds a NaN or infinity
[[nodiscard]] BTFIELD_API SpectralBasis spectral_basis(const Image& image);

/// The planes that vary, each by itself, for models of planes as they are: the rows of T are unit vectors, D
/// as in spectral_basis(). Without planes (`planes` 0) where that would change nothing: all vary and are of
/// one kind.
/// \throws InputError as spectral_basis()
[[nodiscard]] BTFIELD_API SpectralBasis varying_planes(const Image& image);

/// T D⁻¹ (Y − μ), float64 arithmetic stored as float32: r eigenplanes, colour space `unspecified`.
/// \throws InputError when the numbers of planes differ
[[nodiscard]] BTFIELD_API Image to_eigenplanes(const SpectralBasis& basis, const Image& image);

/// D Tᵀ M + μ, the reverse: d planes of this colour space. Gives the picture back to float rounding.
/// \throws InputError when the picture has not r planes
[[nodiscard]] BTFIELD_API Image from_eigenplanes(const SpectralBasis& basis, const Image& eigenplanes,
                                                 ColourSpace space);

/// T D⁻¹ C(s) D⁻¹ Tᵀ at every lag: the statistic of the eigenplanes from that of the picture (theory 5.3).
/// \throws InputError when the numbers of planes differ
[[nodiscard]] BTFIELD_API LagCovariance turned(const SpectralBasis& basis, const LagCovariance& statistic);

/// D Tᵀ C(s) T D of covariances [lag][i][j], r × r a lag → d × d a lag: those of the picture from those of
/// its eigenplanes.
/// \throws InputError when the number of values is not a multiple of r²
[[nodiscard]] BTFIELD_API std::vector<double> turned_back(const SpectralBasis& basis,
                                                          std::span<const double> covariances);

/// \throws InputError naming the first defect: sizes that disagree, numbers that are not finite, scales that
///     are not positive, rows that are not orthonormal to 1e-9
BTFIELD_API void check(const SpectralBasis& basis);

}  // namespace btfield
