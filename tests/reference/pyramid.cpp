#include "tests/reference/pyramid.hpp"

#include <utility>

#include "btfield/pyramid.hpp"

namespace btfield::reference {

namespace {

int wrapped(int value, int period) {
    return ((value % period) + period) % period;
}

/// (Y ⊗ w)(r) = Σ_t w(t1) w(t2) Y(r ⊕ t)
double convolved(const Plane& y, const std::vector<double>& w, int row, int column) {
    const int radius = static_cast<int>(w.size()) / 2;
    double sum = 0.0;
    for (int t1 = -radius; t1 <= radius; ++t1)
        for (int t2 = -radius; t2 <= radius; ++t2)
            sum += w[static_cast<std::size_t>(t1 + radius)] * w[static_cast<std::size_t>(t2 + radius)] *
                   y.at(wrapped(row + t1, y.size.height), wrapped(column + t2, y.size.width));
    return sum;
}

}  // namespace

Plane reduce(const Plane& fine, int factor) {
    const std::vector<double> w = pyramid_kernel(factor);
    Plane coarse(Size{(fine.size.height + factor - 1) / factor, (fine.size.width + factor - 1) / factor});
    for (int row = 0; row < coarse.size.height; ++row)
        for (int column = 0; column < coarse.size.width; ++column)
            coarse.at(row, column) = convolved(fine, w, factor * row, factor * column);
    return coarse;
}

Plane expand(const Plane& coarse, Size size, int factor) {
    const std::vector<double> w = pyramid_kernel(factor);
    Plane zeros(Size{coarse.size.height * factor, coarse.size.width * factor});
    for (int row = 0; row < coarse.size.height; ++row)
        for (int column = 0; column < coarse.size.width; ++column)
            zeros.at(factor * row, factor * column) = coarse.at(row, column);
    Plane fine(size);
    for (int row = 0; row < size.height; ++row)
        for (int column = 0; column < size.width; ++column)
            fine.at(row, column) = factor * factor * convolved(zeros, w, row, column);
    return fine;
}

std::vector<Plane> decompose(const Plane& plane, int levels, int factor) {
    std::vector<Plane> result;
    Plane gaussian = plane;
    for (int k = 1; k < levels; ++k) {
        Plane coarse = reduce(gaussian, factor);
        const Plane expanded = expand(coarse, gaussian.size, factor);
        for (std::size_t i = 0; i < gaussian.values.size(); ++i) gaussian.values[i] -= expanded.values[i];
        result.push_back(std::move(gaussian));
        gaussian = std::move(coarse);
    }
    result.push_back(std::move(gaussian));
    return result;
}

}  // namespace btfield::reference
