#pragma once

// White noise as a function of (seed, level, plane, position), in float64 (theory 14.2).

#include <array>
#include <complex>
#include <cstdint>

#include "btfield/image.hpp"

namespace btfield::reference {

/// Philox 4x32-10: Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC 2011,
/// section 3.3.
std::array<std::uint32_t, 4> philox4x32_10(std::array<std::uint32_t, 4> counter,
                                           std::array<std::uint32_t, 2> key);

/// Box-Muller on both pairs of words: √(−2 ln u) cos 2πv, √(−2 ln u) sin 2πv with u = (⌊w/2⌋ + ½)·2^−31, v =
/// w'·2^−32.
std::array<double, 4> normals(const std::array<std::uint32_t, 4>& words);

/// One normal and the radius √(−2 ln u) that it was made with, on which the accuracy of a float32 draw
/// depends.
struct Draw {
    double value = 0.0;
    double radius = 0.0;
};

/// Noise on the lattice.
Draw spatial_noise(std::uint64_t seed, int level, int plane, int row, int column);

/// Noise in frequency at (kx, ky), 0 <= ky <= H/2: real and imaginary parts of variance 1, Hermitian on the
/// whole lattice, so that bins that are their own conjugates are real with variance 2.
std::complex<double> spectral_noise(std::uint64_t seed, int level, int plane, Size lattice, int kx, int ky);

}  // namespace btfield::reference
