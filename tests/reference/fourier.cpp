#include "tests/reference/fourier.hpp"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace btfield::reference {

namespace {

using Complex = std::complex<double>;

/// out[k] = Σ_j in[j·stride] exp(sign √−1 2π jk/n), k < n.
std::vector<Complex> transform(const Complex* in, int n, std::size_t stride, int sign) {
    std::vector<Complex> roots, out;
    for (int k = 0; k < n; ++k) roots.push_back(std::polar(1.0, sign * 2.0 * std::numbers::pi * k / n));
    for (int k = 0; k < n; ++k) {
        Complex sum = 0.0;
        for (int j = 0; j < n; ++j)
            sum += in[static_cast<std::size_t>(j) * stride] * roots[static_cast<std::size_t>(j * k % n)];
        out.push_back(sum);
    }
    return out;
}

}  // namespace

std::vector<Complex> forward(std::span<const float> plane, Size size) {
    const auto height = static_cast<std::size_t>(size.height), width = static_cast<std::size_t>(size.width);
    const std::vector<Complex> y(plane.begin(), plane.end());
    std::vector<Complex> half(area(size)), spectrum(area(size));
    for (std::size_t row = 0; row < height; ++row) {
        const std::vector<Complex> line = transform(&y[row * width], size.width, 1, -1);
        for (std::size_t kx = 0; kx < width; ++kx) half[kx * height + row] = line[kx];
    }
    for (std::size_t kx = 0; kx < width; ++kx) {
        const std::vector<Complex> line = transform(&half[kx * height], size.height, 1, -1);
        for (std::size_t ky = 0; ky < height; ++ky) spectrum[kx * height + ky] = line[ky];
    }
    return spectrum;
}

std::vector<Complex> inverse(std::span<const Complex> spectrum, Size size) {
    const auto height = static_cast<std::size_t>(size.height), width = static_cast<std::size_t>(size.width);
    std::vector<Complex> half(area(size)), y(area(size));
    for (std::size_t kx = 0; kx < width; ++kx) {
        const std::vector<Complex> line = transform(&spectrum[kx * height], size.height, 1, 1);
        for (std::size_t row = 0; row < height; ++row) half[kx * height + row] = line[row];
    }
    for (std::size_t row = 0; row < height; ++row) {
        const std::vector<Complex> line = transform(&half[row], size.width, height, 1);
        for (std::size_t column = 0; column < width; ++column) y[row * width + column] = line[column];
    }
    return y;
}

}  // namespace btfield::reference
