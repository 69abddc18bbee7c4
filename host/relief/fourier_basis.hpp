#pragma once

// Least squares in frequency on cycles of any length, without a fast transform.

#include <vector>

#include "btfield/image.hpp"

namespace btfield::detail {

/// sin² of the central difference at each frequency of a cycle of n pixels, 0 where it has none: at a turn of
/// 2πk/n a pixel on the torus, of πk/n between mirrors.
[[nodiscard]] std::vector<double> difference_spectrum(int n, bool mirror);

/// Y ↦ what divides the transform of Y by λ + weight, λ the sum of both axes' spectra, and multiplies it by
/// λ²/(λ² + low²): with real Fourier bases as matrices, in float64.
void divide_by_bases(std::vector<double>& values, Size size, const std::vector<double>& across,
                     const std::vector<double>& down, double weight, double low);

}  // namespace btfield::detail
