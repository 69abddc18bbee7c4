#pragma once

#include <span>

#include "btfield/models.hpp"

namespace btfield::peer {

/// y_i(r) = Σ_s Σ_j m_{s,ij} n_j(r ⊖ s) on the torus, m at [(s·d + i)·d + j]: rows of the padded noise,
/// shared out among threads.
void convolve(std::span<const Offset> offsets, std::span<const float> m, int planes, Size size,
              std::span<const float> noise, std::span<float> out);

/// y(r) = Σ_s A_s y(r + s) + L n(r) pixel after pixel, in place, 0 beyond the domain; one thread. Pixels
/// interleave their planes: [row][column][plane].
void causal_recursion(std::span<const Offset> offsets, std::span<const float> a, std::span<const float> root,
                      int planes, Size size, std::span<float> field);

}  // namespace btfield::peer
