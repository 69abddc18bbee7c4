#pragma once

// Theory 5.1, as it is written there.

#include <cstddef>
#include <vector>

#include "btfield/image.hpp"
#include "btfield/neighbourhood.hpp"

namespace btfield::reference {

inline int wrapped(int value, int period) {
    return ((value % period) + period) % period;
}

/// mean_r y_i(r)
inline double mean(const Image& y, int i) {
    double sum = 0.0;
    for (const float value : y.plane(i)) sum += static_cast<double>(value);
    return sum / static_cast<double>(area(y.size()));
}

/// C_ij(s) = mean_r (y_i(r) − μ_i)(y_j(r ⊕ s) − μ_j)
inline double lag_covariance(const Image& y, int i, int j, Offset s) {
    const double mean_i = mean(y, i), mean_j = mean(y, j);
    double sum = 0.0;
    for (int row = 0; row < y.height(); ++row) {
        for (int column = 0; column < y.width(); ++column) {
            const int other_row = wrapped(row + s.row, y.height());
            const int other_column = wrapped(column + s.column, y.width());
            sum += (static_cast<double>(y.at(i, row, column)) - mean_i) *
                   (static_cast<double>(y.at(j, other_row, other_column)) - mean_j);
        }
    }
    return sum / static_cast<double>(area(y.size()));
}

}  // namespace btfield::reference
