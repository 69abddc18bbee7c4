#pragma once

// E[Y | X around r] as theory 18.3 writes it, in float64: one filter of one region after the other.

#include <cstddef>
#include <vector>

#include "btfield/control_field.hpp"
#include "tests/reference/lag_covariance.hpp"
#include "tests/reference/pyramid.hpp"

namespace btfield::reference {

/// Value at a pixel of the torus.
inline double around(const Plane& plane, int row, int column) {
    return plane.at(wrapped(row, plane.size.height), wrapped(column, plane.size.width));
}

/// From scale s − 1 to scale s: two passes of [p, 1 − 2p, p], 2^s pixels apart, along both axes.
inline Plane smoothed(Plane plane, int scale) {
    const int step = 1 << scale;
    const double p = scale == 0 ? 1.0 / 4.0 : 3.0 / 16.0;
    for (const Offset along : {Offset{step, 0}, Offset{step, 0}, Offset{0, step}, Offset{0, step}}) {
        Plane next(plane.size);
        for (int r = 0; r < plane.size.height; ++r)
            for (int c = 0; c < plane.size.width; ++c)
                next.at(r, c) = (1.0 - 2.0 * p) * plane.at(r, c) +
                                p * around(plane, r - along.row, c - along.column) +
                                p * around(plane, r + along.row, c + along.column);
        plane = next;
    }
    return plane;
}

/// h_f * 1[X = region], [filter].
inline std::vector<Plane> filtered_indicator(const ControlField& field, int region) {
    Plane indicator(field.size);
    for (std::size_t i = 0; i < field.labels.size(); ++i)
        indicator.values[i] = field.labels[i] == region ? 1.0 : 0.0;
    std::vector<Plane> filters{indicator}, pairs;
    for (const Offset pair : {Offset{1, 0}, Offset{0, 1}, Offset{1, 1}, Offset{1, -1}}) {
        Plane& both = pairs.emplace_back(field.size);
        for (int r = 0; r < field.size.height; ++r)
            for (int c = 0; c < field.size.width; ++c)
                both.at(r, c) = (around(indicator, r + pair.row, c + pair.column) +
                                 around(indicator, r - pair.row, c - pair.column)) /
                                2.0;
    }
    for (int s = 0; s < 4; ++s) {
        indicator = smoothed(indicator, s);
        Plane down(field.size), across(field.size);
        const int step = 1 << s;
        for (int r = 0; r < field.size.height; ++r)
            for (int c = 0; c < field.size.width; ++c) {
                down.at(r, c) = (around(indicator, r + step, c) - around(indicator, r - step, c)) / 2.0;
                across.at(r, c) = (around(indicator, r, c + step) - around(indicator, r, c - step)) / 2.0;
            }
        filters.push_back(indicator);
        filters.push_back(down);
        filters.push_back(across);
    }
    filters.insert(filters.end(), pairs.begin(), pairs.end());
    return filters;
}

/// M(r) = μ + Σ_k Σ_f w_kf (h_f * 1[X = k])(r), [plane].
/// \param weights [region][filter · planes + plane]
inline std::vector<Plane> conditional_mean(const std::vector<double>& mean,
                                           const std::vector<std::vector<double>>& weights,
                                           const ControlField& field) {
    const std::size_t d = mean.size();
    std::vector<Plane> result(d, Plane(field.size));
    for (std::size_t p = 0; p < d; ++p)
        for (double& value : result[p].values) value = mean[p];
    for (std::size_t k = 0; k < weights.size(); ++k) {
        const std::vector<Plane> filters = filtered_indicator(field, static_cast<int>(k));
        for (std::size_t f = 0; f < weights[k].size() / d; ++f)
            for (std::size_t p = 0; p < d; ++p)
                for (std::size_t i = 0; i < field.labels.size(); ++i)
                    result[p].values[i] += weights[k][f * d + p] * filters[f].values[i];
    }
    return result;
}

}  // namespace btfield::reference
