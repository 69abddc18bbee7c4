#pragma once

// Discrete Fourier transforms by their definition, in float64. Neither direction scales.

#include <complex>
#include <span>
#include <vector>

#include "btfield/image.hpp"

namespace btfield::reference {

/// Y_t = Σ_r y(r) exp(−√−1 ω_t·r) at every frequency: (kx, ky) is at [kx·H + ky], ω_t·r = 2π (kx·column/W +
/// ky·row/H).
std::vector<std::complex<double>> forward(std::span<const float> plane, Size size);

/// y(r) = Σ_t Y_t exp(+√−1 ω_t·r), [row][column], of a whole spectrum.
std::vector<std::complex<double>> inverse(std::span<const std::complex<double>> spectrum, Size size);

}  // namespace btfield::reference
