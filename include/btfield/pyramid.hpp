#pragma once

/// \file
/// Gaussian-Laplacian pyramid on the torus (theory 2; P0 2.1, P3 2.2).

#include <vector>

#include "btfield/api.hpp"
#include "btfield/device.hpp"
#include "btfield/image.hpp"

namespace btfield {

/// Sizes of the levels, finest first: ceil(H/n) × ceil(W/n) from one to the next.
/// \throws InputError when levels < 1 or factor < 2
[[nodiscard]] BTFIELD_API std::vector<Size> pyramid_sizes(Size size, int levels, int factor);

/// Separable low-pass w of length 2n + 1, sum 1, equal sums over every phase modulo n (theory 2.1): for n = 2
/// [.05 .25 .4 .25 .05] (Burt and Adelson, a = 0.4), else a triangle of 2n − 1 taps convolved with [1 2 1]/4.
/// \throws InputError when factor < 2
[[nodiscard]] BTFIELD_API std::vector<double> pyramid_kernel(int factor);

/// Laplacian levels Y'_k = Y_k − ↑n(Y_{k+1}), the last one the Gaussian level (theory 2.3). levels = 1
/// returns the picture.
/// \throws InputError as pyramid_sizes() does
[[nodiscard]] BTFIELD_API std::vector<Image> decompose(Device& device, const Image& image, int levels,
                                                       int factor);

/// Inverse of decompose to float rounding, for every size.
/// \throws InputError when the level sizes do not belong to one pyramid
[[nodiscard]] BTFIELD_API Image collapse(Device& device, const std::vector<Image>& levels, int factor);

}  // namespace btfield
