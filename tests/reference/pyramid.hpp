#pragma once

// Pyramid steps on one plane as theory 2.2 writes them, in float64.

#include <vector>

#include "btfield/image.hpp"

namespace btfield::reference {

/// One plane, [row][column].
struct Plane {
    Size size;
    std::vector<double> values;
    explicit Plane(Size s) : size(s), values(area(s)) {}
    Plane(const Image& image, int plane) : size(image.size()) {
        for (const float value : image.plane(plane)) values.push_back(static_cast<double>(value));
    }
    [[nodiscard]] double& at(int row, int column) {
        return values[static_cast<std::size_t>(row) * static_cast<std::size_t>(size.width) +
                      static_cast<std::size_t>(column)];
    }
    [[nodiscard]] double at(int row, int column) const { return const_cast<Plane&>(*this).at(row, column); }
};

/// ↓n(Y ⊗ w), w on the torus of Y.
Plane reduce(const Plane& fine, int factor);
/// ↑n: zeros between the values, convolution with n·w (each axis) on the torus of the enlarged plane, crop to
/// `size`.
Plane expand(const Plane& coarse, Size size, int factor);
/// Laplacian levels and the Gaussian one.
std::vector<Plane> decompose(const Plane& plane, int levels, int factor);

}  // namespace btfield::reference
