#pragma once

// Height from slopes as theory 19.2 writes it, in float64: transforms by their definition, on the torus or
// on one of twice both sides that is mirrored.

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <vector>

#include "btfield/height.hpp"
#include "tests/reference/fourier.hpp"

namespace btfield::reference {

/// A plane on the torus: of twice both sides where edges mirror. `row_sign` and `column_sign` say what
/// happens to a value that is mirrored along that axis.
inline Image on_torus(const Image& image, int plane, SurfaceEdges edges, float row_sign, float column_sign) {
    const Size size = image.size();
    if (edges == SurfaceEdges::periodic) {
        Image copy(size, 1);
        std::ranges::copy(image.plane(plane), copy.values().begin());
        return copy;
    }
    Image twice({2 * size.height, 2 * size.width}, 1);
    for (int r = 0; r < twice.height(); ++r)
        for (int c = 0; c < twice.width(); ++c) {
            const bool below = r >= size.height, beyond = c >= size.width;
            twice.at(0, r, c) =
                image.at(plane, below ? twice.height() - 1 - r : r, beyond ? twice.width() - 1 - c : c) *
                (below ? row_sign : 1.0F) * (beyond ? column_sign : 1.0F);
        }
    return twice;
}

/// Where |∇h − (p, q)|² + μ |h − h₀|² is least, μ = sin²(2π / wavelength); mean 0. Waves are multiplied by
/// λ² / (λ² + low²).
inline std::vector<double> height(const Image& slopes, SurfaceEdges edges,
                                  const CoarseHeight* coarse = nullptr, double low = 0.0) {
    using Complex = std::complex<double>;
    const Image p = on_torus(slopes, 0, edges, 1.0F, -1.0F), q = on_torus(slopes, 1, edges, -1.0F, 1.0F);
    const Size size = p.size();
    const std::vector<Complex> across = forward(p.values(), size), down = forward(q.values(), size);
    std::vector<Complex> base(area(size));
    double weight = 0.0;
    if (coarse != nullptr) {
        base = forward(on_torus(coarse->height, 0, edges, 1.0F, 1.0F).values(), size);
        weight = std::pow(std::sin(2.0 * std::numbers::pi / coarse->wavelength), 2);
    }
    const auto sine = [](int k, int n) {
        return 2 * k == n ? 0.0 : std::sin(2.0 * std::numbers::pi * k / n);
    };
    std::vector<Complex> spectrum(area(size));
    for (int kx = 0; kx < size.width; ++kx)
        for (int ky = 0; ky < size.height; ++ky) {
            const auto at = static_cast<std::size_t>(kx * size.height + ky);
            const double sx = sine(kx, size.width), sy = sine(ky, size.height);
            const double lambda = sx * sx + sy * sy;
            if (at == 0 || !(lambda + weight > 0.0)) continue;
            const double kept = low > 0.0 ? lambda * lambda / (lambda * lambda + low * low) : 1.0;
            // The conjugate of √−1 sin ω, the transform of the central difference.
            spectrum[at] =
                kept * (Complex(0.0, -sx) * across[at] + Complex(0.0, -sy) * down[at] + weight * base[at]) /
                ((lambda + weight) * static_cast<double>(area(size)));
        }
    const std::vector<Complex> whole = inverse(spectrum, size);
    std::vector<double> result;
    for (int r = 0; r < slopes.height(); ++r)
        for (int c = 0; c < slopes.width(); ++c)
            result.push_back(whole[static_cast<std::size_t>(r * size.width + c)].real());
    return result;
}

}  // namespace btfield::reference
