#pragma once

// Fourier transforms of whole pictures on the host, in float64.

#include <complex>
#include <vector>

#include "btfield/image.hpp"

namespace btfield::detail {

using PictureSpectrum = std::vector<std::complex<double>>;

/// Fourier transform of a plane, H × W row-major, its mean removed, not scaled.
[[nodiscard]] PictureSpectrum spectrum_of(const Image& image, int plane);
/// Of each plane.
[[nodiscard]] std::vector<PictureSpectrum> spectra_of(const Image& image);

}  // namespace btfield::detail
