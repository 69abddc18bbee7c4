#pragma once

// Passes over the frequencies of a Hermitian polynomial, which the likelihoods of Markov fields are made of.

#include <algorithm>
#include <optional>
#include <vector>

#include "host/base/parallel.hpp"
#include "host/spectrum/lattice.hpp"

namespace btfield::detail {

/// What a pass does besides the mean of ln det.
enum class Sweep {
    logarithm,   ///< visit() sees nothing of use
    inverse,     ///< it sees the inverse
    everything,  ///< the inverse and the polynomial itself
};

/// Calls visit(block, m, inverse, polynomial) for every row m of the grid, from several threads at a time;
/// rows of one block one after another.
/// \return mean ln det, nothing when indefinite somewhere
template <class Visit>
std::optional<double> sweep_rows(const HermitianPolynomial& polynomial, const FrequencyGrid& grid,
                                 const Waves& waves, Sweep kind, const Visit& visit) {
    const RowBlocks blocks(static_cast<int>(grid.row.size()));
    std::vector<double> sums(static_cast<std::size_t>(blocks.count));
    std::vector<char> positive(static_cast<std::size_t>(blocks.count), 1);
    for_each_block(blocks.count, [&](int block) {
        LaneMatrix matrix(polynomial.planes(), grid.column.size()), before;
        std::vector<double> logarithms(grid.column.size());
        for (int row = blocks.first(block); row < blocks.last(block); ++row) {
            const auto m = static_cast<std::size_t>(row);
            evaluate(polynomial, grid.row[m], waves, matrix);
            if (kind == Sweep::everything) {
                before = matrix;
                before.complete_hermitian();
            }
            std::fill(logarithms.begin(), logarithms.end(), 0.0);
            if (!(kind == Sweep::logarithm ? factorise_positive(matrix, logarithms.data())
                                           : invert_positive(matrix, logarithms.data()))) {
                positive[static_cast<std::size_t>(block)] = 0;
                return;
            }
            double sum = 0.0;
            for (std::size_t n = 0; n < logarithms.size(); ++n) sum += grid.column_weight[n] * logarithms[n];
            sums[static_cast<std::size_t>(block)] += grid.row_weight[m] * sum;
            visit(block, m, matrix, before);
        }
    });
    double mean = 0.0;
    for (std::size_t k = 0; k < sums.size(); ++k) {
        if (positive[k] == 0) return std::nullopt;
        mean += sums[k];
    }
    return mean;
}

/// Empty sums of every block of a pass over the grid that the transform is of.
[[nodiscard]] inline std::vector<LagSums> sums_of_blocks(int rows, const LagTransform& transform,
                                                         Eigen::Index functions) {
    const RowBlocks blocks(rows);
    return {static_cast<std::size_t>(blocks.count), LagSums(transform, functions, blocks.per_block)};
}

/// mean_t K_t of a Hermitian K whose lower triangle has been summed, as lower_triangle() arranges it.
[[nodiscard]] inline Eigen::MatrixXd mean_of(const LagMeans& means, int planes) {
    Eigen::MatrixXd mean(planes, planes);
    for (int i = 0; i < planes; ++i) {
        for (int j = 0; j <= i; ++j) mean(i, j) = mean(j, i) = means(Eigen::Index{i} * (i + 1) / 2 + j, {});
    }
    return mean;
}

}  // namespace btfield::detail
