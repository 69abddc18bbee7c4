#pragma once

// The inner loop of lag covariances: products of centred rows, summed in float64.

#include <span>
#include <vector>

#include "btfield/image.hpp"

namespace btfield::detail {

/// Lags that share a row offset: s = (row, columns[k]), with 0 <= row < H and |columns[k]| < W.
struct LagRow {
    int row = 0;
    std::vector<int> columns;
};

/// Mean of each plane, float64.
[[nodiscard]] std::vector<double> plane_means(const Image& image);

/// sum_r (y_i(r) − μ_i)(y_j(r ⊕ s) − μ_j) for every lag s, lag rows one after the other: [lag][i][j].
/// The same for any number of threads.
[[nodiscard]] std::vector<double> lag_products(const Image& image, std::span<const double> means,
                                               std::span<const LagRow> lags);

}  // namespace btfield::detail
