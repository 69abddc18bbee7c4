#include "host/spectrum/lag_transform.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "host/spectrum/half_grid.hpp"

namespace btfield::detail {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
constexpr double two_pi = 2.0 * std::numbers::pi;
constexpr int functions = 3;

/// x(−ω) = conj x(ω): a few waves with real coefficients, and one that is none.
Complex function(int k, double row, double column) {
    const double a = 1.0 + k;
    return 0.3 * a + std::polar(1.0, 2.0 * row - column) - a * std::polar(0.5, row + k * column) +
           1.0 / Complex(2.5 + std::cos(column), 0.2 * a * std::sin(row));
}

/// Sum over whole rows and columns of weights × values.
struct Axis {
    std::vector<double> node, weight;
};

double direct(int k, const Axis& rows, const Axis& columns, Offset u) {
    Complex sum;
    for (std::size_t m = 0; m < rows.node.size(); ++m) {
        for (std::size_t n = 0; n < columns.node.size(); ++n) {
            const double w1 = rows.node[m], w2 = columns.node[n];
            sum += rows.weight[m] * columns.weight[n] * function(k, w1, w2) *
                   std::polar(1.0, w1 * u.row + w2 * u.column);
        }
    }
    return sum.real();
}

LagMeans transformed(const LagTransform& transform, const std::vector<double>& rows,
                     const std::vector<double>& columns, int most_blocks) {
    const RowBlocks blocks(static_cast<int>(rows.size()), most_blocks);
    std::vector<LagSums> parts(static_cast<std::size_t>(blocks.count),
                               LagSums(transform, functions, blocks.per_block));
    RowMajorMatrix values(2 * functions, static_cast<Index>(columns.size()));
    for (int block = 0; block < blocks.count; ++block) {
        for (int m = blocks.first(block); m < blocks.last(block); ++m) {
            for (int k = 0; k < functions; ++k) {
                for (std::size_t n = 0; n < columns.size(); ++n) {
                    const Complex value = function(k, rows[static_cast<std::size_t>(m)], columns[n]);
                    values(2 * k, static_cast<Index>(n)) = value.real();
                    values(2 * k + 1, static_cast<Index>(n)) = value.imag();
                }
            }
            parts[static_cast<std::size_t>(block)].add(static_cast<std::size_t>(m), values);
        }
    }
    return means_of(parts);
}

/// Sums of N values below 5 lose N units in the last place at most.
double rounding(std::size_t rows, std::size_t columns) {
    return 5.0 * static_cast<double>(rows * columns) * std::numeric_limits<double>::epsilon();
}

void expect_direct(const LagMeans& means, const Axis& rows, const Axis& columns, Offset box) {
    for (int k = 0; k < functions; ++k) {
        for (int row = -box.row; row <= box.row; ++row) {
            for (int column = -box.column; column <= box.column; ++column) {
                const double expected = direct(k, rows, columns, {row, column});
                EXPECT_LE(std::abs(means(k, {row, column}) - expected),
                          rounding(rows.node.size(), columns.node.size()))
                    << k << " at " << row << ", " << column;
                EXPECT_EQ(means.at({row, column})[k], means(k, {row, column}));
            }
        }
    }
}

TEST(LagTransform, UniformGrids) {
    for (const Size size : {Size{1, 1}, Size{8, 8}, Size{7, 12}, Size{16, 5}}) {
        Axis rows, columns;
        for (int m = 0; m < size.height; ++m) {
            rows.node.push_back(two_pi * m / size.height);
            rows.weight.push_back(1.0 / size.height);
        }
        for (int n = 0; n < size.width; ++n) {
            columns.node.push_back(two_pi * n / size.width);
            columns.weight.push_back(1.0 / size.width);
        }
        const std::vector<double> half(rows.node.begin(), rows.node.begin() + half_rows(size.height));
        for (const Offset box : {Offset{0, 0}, Offset{2, 3}, Offset{4, 1}}) {
            const LagTransform transform(size, box);
            for (const int blocks : {1, 3, 32})
                expect_direct(transformed(transform, half, columns.node, blocks), rows, columns, box);
        }
    }
}

TEST(LagTransform, ClusteredGrids) {
    const FrequencyGrid grid = clustered_grid({8, 4, 2, 1});
    Axis rows{grid.row, {}}, columns{grid.column, grid.column_weight};
    for (std::size_t m = 0; m < grid.row.size(); ++m) {
        const bool mirrored = m > 0 && m + 1 < grid.row.size();
        rows.weight.push_back(mirrored ? 0.5 * grid.row_weight[m] : grid.row_weight[m]);
    }
    for (std::size_t m = 1; m + 1 < grid.row.size(); ++m) {
        rows.node.push_back(-grid.row[m]);
        rows.weight.push_back(0.5 * grid.row_weight[m]);
    }
    const Offset box{3, 2};
    const LagTransform transform(grid, box);
    for (const int blocks : {1, 4, 32})
        expect_direct(transformed(transform, grid.row, grid.column, blocks), rows, columns, box);
}

}  // namespace
}  // namespace btfield::detail
