#include "host/base/dense.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <vector>

namespace btfield::detail {
namespace {

using Eigen::Index;

constexpr Index tile_columns = 8;

struct Strip {
    Index depth;
    const double* a;  ///< rows
    Index a_stride;
    const double* panel;  ///< tile_columns of b, row after row, zeros beyond the last
    double* c;
    Index c_stride, columns;
};

/// Rows × tile_columns of the product, in registers.
template <class Lanes, Index Rows>
[[gnu::always_inline]] inline void add_tile(const Strip& strip, Index first) {
    constexpr Index width = sizeof(Lanes) / sizeof(double), vectors = tile_columns / width;
    Lanes sums[Rows][vectors] = {};
    const double* const a = strip.a + first * strip.a_stride;
    for (Index k = 0; k < strip.depth; ++k) {
        Lanes b[vectors];
        std::memcpy(&b, strip.panel + k * tile_columns, sizeof b);
#pragma GCC unroll 8
        for (Index r = 0; r < Rows; ++r) {
            const double factor = a[r * strip.a_stride + k];
#pragma GCC unroll 4
            for (Index v = 0; v < vectors; ++v) sums[r][v] += factor * b[v];
        }
    }
    for (Index r = 0; r < Rows; ++r) {
        double values[tile_columns];
        std::memcpy(&values, &sums[r], sizeof values);
        double* const c = strip.c + (first + r) * strip.c_stride;
        for (Index n = 0; n < strip.columns; ++n) c[n] += values[n];
    }
}

/// \tparam Rows of a tile whose sums still fit the registers
template <class Lanes, Index Rows>
[[gnu::always_inline]] inline void add_tiles(const Strip& strip, Index rows) {
    Index first = 0;
    for (; first + Rows <= rows; first += Rows) add_tile<Lanes, Rows>(strip, first);
    for (; first < rows; ++first) add_tile<Lanes, 1>(strip, first);
}

using TwoLanes [[gnu::vector_size(16)]] = double;
void add_strip_baseline(const Strip& strip, Index rows) {
    add_tiles<TwoLanes, 2>(strip, rows);
}
#if defined(__x86_64__)
using FourLanes [[gnu::vector_size(32)]] = double;
using EightLanes [[gnu::vector_size(64)]] = double;
[[gnu::target("avx2,fma")]] void add_strip_avx2(const Strip& strip, Index rows) {
    add_tiles<FourLanes, 6>(strip, rows);
}
[[gnu::target("avx512f,fma")]] void add_strip_avx512(const Strip& strip, Index rows) {
    add_tiles<EightLanes, 8>(strip, rows);
}
#endif

using AddStrip = void (*)(const Strip&, Index);

AddStrip choose_add_strip() {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("fma")) return add_strip_avx512;
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return add_strip_avx2;
#endif
    return add_strip_baseline;
}

}  // namespace

void add_product(const ConstRows& a, const ConstRows& b, Rows c) {
    static const AddStrip add_strip = choose_add_strip();
    const Index depth = a.cols();
    std::vector<double> panel(static_cast<std::size_t>(depth * tile_columns));
    for (Index first = 0; first < b.cols(); first += tile_columns) {
        const Index columns = std::min(tile_columns, b.cols() - first);
        for (Index k = 0; k < depth; ++k)
            std::copy_n(b.data() + k * b.outerStride() + first, columns, panel.data() + k * tile_columns);
        if (columns < tile_columns) {
            for (Index k = 0; k < depth; ++k)
                std::fill_n(panel.data() + k * tile_columns + columns, tile_columns - columns, 0.0);
        }
        add_strip(
            {depth, a.data(), a.outerStride(), panel.data(), c.data() + first, c.outerStride(), columns},
            a.rows());
    }
}

Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, const Eigen::MatrixXd& c) {
    return a * b * c;
}

Eigen::MatrixXcd product(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b) {
    return a * b;
}

Eigen::MatrixXd congruent(const Eigen::MatrixXd& a, const Eigen::MatrixXd& m) {
    return a * m * a.transpose();
}

Cholesky::Cholesky(const Eigen::MatrixXd& matrix) : factor_(matrix) {
    constexpr Index width = 32;
    const Index n = factor_.rows();
    for (Index first = 0; first < n; first += width) {
        const Index own = std::min(width, n - first), below = first + own, rest = n - below;
        auto corner = factor_.block(first, first, own, own);
        for (Index j = 0; j < own; ++j) {
            const double pivot = corner(j, j) - corner.row(j).head(j).squaredNorm();
            if (!(pivot > 0.0) || !std::isfinite(pivot)) {
                positive_ = false;
                return;
            }
            const double root = std::sqrt(pivot);
            corner(j, j) = root;
            for (Index i = j + 1; i < own; ++i)
                corner(i, j) = (corner(i, j) - corner.row(i).head(j).dot(corner.row(j).head(j))) / root;
        }
        if (rest == 0) break;
        const RowMajorMatrix inverse =
            corner.triangularView<Eigen::Lower>().solve(RowMajorMatrix::Identity(own, own));
        auto panel = factor_.block(below, first, rest, own);
        RowMajorMatrix solved = RowMajorMatrix::Zero(rest, own);
        add_product(panel, RowMajorMatrix(inverse.transpose()), solved);
        panel = solved;
        const RowMajorMatrix across = -solved.transpose();
        // The part of what follows that is on or below the diagonal, and a little more.
        for (Index at = 0; at < rest; at += width) {
            const Index columns = std::min(width, rest - at);
            add_product(solved.bottomRows(rest - at), across.middleCols(at, columns),
                        factor_.block(below + at, below + at, rest - at, columns));
        }
    }
}

Eigen::VectorXd Cholesky::solve(const Eigen::VectorXd& b) const {
    Eigen::VectorXd x = factor_.triangularView<Eigen::Lower>().solve(b);
    factor_.triangularView<Eigen::Lower>().transpose().solveInPlace(x);
    return x;
}

}  // namespace btfield::detail
