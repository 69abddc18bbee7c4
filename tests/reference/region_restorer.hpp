#pragma once

// The last station of compound synthesis and its treatment of borders as theory 18.5 writes them, in float64.

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "btfield/compound.hpp"
#include "tests/reference/lag_covariance.hpp"
#include "tests/reference/plane_restorer.hpp"
#include "tests/reference/pyramid.hpp"

namespace btfield::reference {

/// W x of a region; as many of x as the region's residual models.
inline std::vector<double> whitened(const TextureModel& residual, const std::vector<double>& x) {
    const auto r = static_cast<std::size_t>(modelled_planes(residual));
    std::vector<double> result(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(r));
    for (std::size_t i = 0; i < r && !residual.whitening.empty(); ++i) {
        result[i] = 0.0;
        for (std::size_t j = 0; j < r; ++j) result[i] += residual.whitening[i * r + j] * x[j];
    }
    return result;
}

/// T, the identity where there is none.
inline std::vector<double> turning(const TextureModel& residual) {
    if (!residual.basis.matrix.empty()) return residual.basis.matrix;
    const auto d = static_cast<std::size_t>(residual.planes);
    std::vector<double> t(d * d, 0.0);
    for (std::size_t i = 0; i < d; ++i) t[i * d + i] = 1.0;
    return t;
}

/// y = c + a (b (M − c) + μ + Tᵀ q(W x)) of one pixel.
inline std::vector<double> restored(const CompoundRegion& region, const std::vector<double>& x,
                                    const std::vector<double>& m) {
    std::vector<double> g = whitened(region.residual, x);
    for (std::size_t i = 0; i < region.residual.marginals.size(); ++i)
        g[i] = mapped(region.residual.marginals[i].values, g[i]);
    std::vector<double> y = restored(turning(region.residual), region.residual.mean, g);
    for (std::size_t p = 0; p < y.size(); ++p) {
        const double c = region.colour[p];
        y[p] = c + region.contrast * (region.structure * (m[p] - c) + y[p]);
    }
    return y;
}

/// The word that decides whether a pixel and the next change places: MurmurHash3's finalisation.
inline std::uint32_t pixel_word(std::uint64_t seed, std::uint32_t pixel, std::uint32_t turn) {
    std::uint32_t h = pixel * 0x9e3779b9U ^ static_cast<std::uint32_t>(seed) ^ turn * 0x85ebca6bU;
    h = (h ^ h >> 16) * 0x85ebca6bU;
    h = ((h ^ h >> 13) ^ static_cast<std::uint32_t>(seed >> 32)) * 0xc2b2ae35U;
    return h ^ h >> 16;
}

/// One turn: pairs along the rows (`across`) or columns that begin at even or odd pixels. Pairs of the last
/// and the first pixel are of sides that are even.
inline void swap_turn(std::vector<Plane>& planes, const ControlField& field, std::uint64_t seed,
                      std::uint32_t turn, bool across, int parity) {
    const auto [height, width] = field.size;
    const auto place = [w = width](int r, int c) { return static_cast<std::size_t>(r * w + c); };
    const int side = across ? width : height, others = across ? height : width;
    for (int first = parity; first < side; first += 2)
        for (int other = 0; other < others; ++other) {
            if (side % 2 == 1 && first == side - 1) continue;
            const int next = (first + 1) % side;
            const std::size_t a = across ? place(other, first) : place(first, other);
            const std::size_t b = across ? place(other, next) : place(next, other);
            const bool border = field.labels[a] != field.labels[b];
            if (!border || pixel_word(seed, static_cast<std::uint32_t>(a), turn) % 2 == 0) continue;
            for (Plane& plane : planes) std::swap(plane.values[a], plane.values[b]);
        }
}

/// Whether a pixel has another region among its eight neighbours.
inline bool at_border(const ControlField& field, int row, int column) {
    const auto label = [&](int r, int c) {
        const int place = wrapped(r, field.size.height) * field.size.width + wrapped(c, field.size.width);
        return field.labels[static_cast<std::size_t>(place)];
    };
    for (int r = row - 1; r <= row + 1; ++r)
        for (int c = column - 1; c <= column + 1; ++c)
            if (label(r, c) != label(row, column)) return true;
    return false;
}

/// [1 2 1]/4 along both axes at borders.
inline Plane smoothed_borders(const Plane& plane, const ControlField& field) {
    Plane result = plane;
    for (int row = 0; row < field.size.height; ++row)
        for (int column = 0; column < field.size.width; ++column) {
            if (!at_border(field, row, column)) continue;
            double sum = 0.0;
            for (int r = -1; r <= 1; ++r)
                for (int c = -1; c <= 1; ++c)
                    sum +=
                        (r == 0 ? 0.5 : 0.25) * (c == 0 ? 0.5 : 0.25) *
                        plane.at(wrapped(row + r, field.size.height), wrapped(column + c, field.size.width));
            result.at(row, column) = sum;
        }
    return result;
}

/// Four turns, twice over, and smoothing.
inline std::vector<Plane> treated_borders(std::vector<Plane> planes, const ControlField& field,
                                          std::uint64_t seed) {
    std::uint32_t turn = 0;
    for (int round = 0; round < 2; ++round)
        for (const int parity : {0, 1})
            for (const bool across : {true, false}) swap_turn(planes, field, seed, turn++, across, parity);
    for (Plane& plane : planes) plane = smoothed_borders(plane, field);
    return planes;
}

}  // namespace btfield::reference
