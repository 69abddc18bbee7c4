#include "host/btf/reduced_view.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "host/base/dense.hpp"
#include "host/base/parallel.hpp"
#include "host/btf/spread_pixels.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Pixels that are worked on together.
constexpr std::size_t reduced_pixels = 2048;
/// Pixels that the basis is found from: more tell nothing new of so many rows.
constexpr std::size_t basis_pixels = 16384;
/// Steps of the subspace iteration: singular values of pictures fall fast.
constexpr int basis_steps = 4;

/// Rows of z, [row][pixel], each with mean 0.
struct RelativeRows {
    std::vector<float> values;
    std::size_t pixels = 0;
    [[nodiscard]] const float* row(std::size_t r) const { return values.data() + r * pixels; }
};

/// I to z − offset in place; tells μ, the deviation of I / μ, offset and Σ (z − offset)².
struct RowMoments {
    double mean = 0.0, contrast = 0.0, offset = 0.0, energy = 0.0;
};
RowMoments relate(std::span<float> row) {
    RowMoments moments;
    const auto count = static_cast<double>(row.size());
    double sum = 0.0;
    for (float& value : row) {
        value = std::max(value, 0.0F);
        sum += static_cast<double>(value);
    }
    moments.mean = sum / count;
    if (!(moments.mean > 0.0)) return moments;
    const auto scale = static_cast<float>(1.0 / moments.mean);
    double total = 0.0, squares = 0.0, spread = 0.0;
    for (float& value : row) {
        const double off = static_cast<double>(value * scale) - 1.0;
        spread += off * off;
        value = std::sqrt(value * scale);
        total += static_cast<double>(value);
    }
    moments.contrast = std::sqrt(spread / count);
    moments.offset = total / count;
    const auto offset = static_cast<float>(moments.offset);
    for (float& value : row) {
        value -= offset;
        squares += static_cast<double>(value) * static_cast<double>(value);
    }
    moments.energy = squares;
    return moments;
}

/// Z Zᵀ over some pixels.
MatrixXd gram(const RelativeRows& rows, std::size_t count) {
    const std::vector<std::size_t> chosen = spread_pixels(rows.pixels, basis_pixels);
    const auto n = static_cast<Index>(count);
    RowMajorMatrix sum = RowMajorMatrix::Zero(n, n);
    for (std::size_t first = 0; first < chosen.size(); first += reduced_pixels) {
        const std::size_t size = std::min(reduced_pixels, chosen.size() - first);
        RowMajorMatrix block(n, static_cast<Index>(size));
        for (std::size_t r = 0; r < count; ++r)
            for (std::size_t p = 0; p < size; ++p)
                block(static_cast<Index>(r), static_cast<Index>(p)) =
                    static_cast<double>(rows.row(r)[chosen[first + p]]);
        const RowMajorMatrix across = block.transpose();
        add_product(block, across, sum);
    }
    return sum;
}

/// Q whose columns are orthonormal and span those of y, as far as these are independent.
MatrixXd orthonormal(const MatrixXd& y) {
    if (y.cols() == 0) return y;
    const MatrixXd moments = y.transpose() * y;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(moments);
    const double least = 1e-13 * std::max(solver.eigenvalues().tail(1)[0], 1e-300);
    Index kept = 0;
    while (kept < moments.rows() && solver.eigenvalues()[moments.rows() - 1 - kept] > least) ++kept;
    MatrixXd q = y * solver.eigenvectors().rightCols(kept);
    for (Index c = 0; c < kept; ++c) q.col(c).normalize();
    return q;
}

/// Leading eigenvectors of a Gram matrix.
MatrixXd leading_vectors(const MatrixXd& matrix, int rank) {
    const Index n = matrix.rows(), columns = std::min<Index>(n, rank + 8);
    MatrixXd q(n, columns);
    // Any start that is no eigenvector will do; the same one for everybody.
    std::uint32_t state = 1;
    for (Index c = 0; c < columns; ++c)
        for (Index r = 0; r < n; ++r) {
            state = state * 1664525U + 1013904223U;
            q(r, c) = static_cast<double>(state >> 8) / 16777216.0 - 0.5;
        }
    for (int step = 0; step < basis_steps; ++step) {
        const MatrixXd next = matrix * q;
        q = orthonormal(next);
        // Columns are orthonormal only as far as the first product had them so.
        const MatrixXd again = q;
        q = orthonormal(again);
    }
    if (q.cols() == 0) return q;
    const MatrixXd inner = q.transpose() * matrix * q;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(inner);
    const MatrixXd turned = q * solver.eigenvectors();
    return turned.rightCols(std::min<Index>(rank, turned.cols())).rowwise().reverse();
}

/// Aᵀ Z of some pixels, [column of A][pixel].
RowMajorMatrix projection(const RelativeRows& rows, const RowMajorMatrix& across, std::size_t first,
                          std::size_t size) {
    RowMajorMatrix block(across.cols(), static_cast<Index>(size));
    for (Index r = 0; r < block.rows(); ++r) {
        const float* const from = rows.row(static_cast<std::size_t>(r)) + first;
        std::copy_n(from, size, block.data() + r * static_cast<Index>(size));
    }
    RowMajorMatrix result = RowMajorMatrix::Zero(across.rows(), static_cast<Index>(size));
    add_product(across, block, result);
    return result;
}

constexpr double largest_short = 32767.0;

void keep_values(const RowMajorMatrix& projected, ReducedView& view) {
    const Index rank = projected.rows(), pixels = projected.cols();
    view.units.resize(static_cast<std::size_t>(rank));
    std::vector<std::int16_t> values(static_cast<std::size_t>(rank * pixels));
    for (Index k = 0; k < rank; ++k) {
        const double largest = std::max(projected.row(k).cwiseAbs().maxCoeff(), 1e-30);
        view.units[static_cast<std::size_t>(k)] = largest / largest_short;
        for (Index p = 0; p < pixels; ++p)
            values[static_cast<std::size_t>(p * rank + k)] =
                static_cast<std::int16_t>(std::lround(projected(k, p) * largest_short / largest));
    }
    view.values = SharedNumbers(std::move(values));
}

}  // namespace

void ReducedView::take(std::size_t first, Eigen::Ref<RowMajorMatrix> result) const {
    const std::size_t columns = rank();
    for (Index i = 0; i < result.rows(); ++i) {
        const std::int16_t* const from =
            values.span().data() + (first + static_cast<std::size_t>(i)) * columns;
        double* const to = result.data() + i * result.outerStride();
        for (std::size_t k = 0; k < columns; ++k) to[k] = units[k] * static_cast<double>(from[k]);
    }
}

ReducedView reduce_view(int pictures, int colours, std::size_t pixels, int rank,
                        const std::function<void(int, std::span<float>)>& read) {
    const auto count = static_cast<std::size_t>(pictures) * static_cast<std::size_t>(colours);
    RelativeRows rows{std::vector<float>(count * pixels), pixels};
    ReducedView view;
    view.mean.resize(count);
    view.contrast.resize(count);
    view.offset.resize(count);
    std::vector<double> energies(count);
    for_each_block(pictures, [&](int picture) {
        const std::size_t first = static_cast<std::size_t>(picture) * static_cast<std::size_t>(colours);
        const std::span<float> all(rows.values.data() + first * pixels,
                                   static_cast<std::size_t>(colours) * pixels);
        read(picture, all);
        for (std::size_t c = 0; c < static_cast<std::size_t>(colours); ++c) {
            const RowMoments moments = relate(all.subspan(c * pixels, pixels));
            view.mean[first + c] = moments.mean;
            view.contrast[first + c] = moments.contrast;
            view.offset[first + c] = moments.offset;
            energies[first + c] = moments.energy;
        }
    });
    view.energy = std::accumulate(energies.begin(), energies.end(), 0.0);
    view.basis = leading_vectors(gram(rows, count), rank);
    if (view.basis.cols() == 0) {
        view.lost = view.energy;
        return view;
    }
    const RowMajorMatrix across = view.basis.transpose();
    RowMajorMatrix projected(across.rows(), static_cast<Index>(pixels));
    const int blocks = static_cast<int>((pixels + reduced_pixels - 1) / reduced_pixels);
    for_each_block(blocks, [&](int block) {
        const std::size_t first = static_cast<std::size_t>(block) * reduced_pixels;
        const std::size_t size = std::min(reduced_pixels, pixels - first);
        projected.middleCols(static_cast<Index>(first), static_cast<Index>(size)) =
            projection(rows, across, first, size);
    });
    view.lost = std::max(view.energy - projected.squaredNorm(), 0.0);
    keep_values(projected, view);
    return view;
}

double reduced_bytes(std::size_t rows, std::size_t pixels, int rank) {
    return std::min(static_cast<double>(rank), static_cast<double>(rows)) * static_cast<double>(pixels) *
           sizeof(std::int16_t);
}

double reduction_bytes(std::size_t rows, std::size_t pixels, int rank) {
    const double pictures = static_cast<double>(rows) * static_cast<double>(pixels) * sizeof(float);
    // And the projection in double precision.
    return pictures + 5.0 * reduced_bytes(rows, pixels, rank);
}

ReducedView windowed(const ReducedView& view, Size size, int row, int column, Size part) {
    ReducedView result = view;
    const double share = static_cast<double>(area(part)) / static_cast<double>(area(size));
    result.energy *= share;
    result.lost *= share;
    const std::size_t rank = view.rank(), width = static_cast<std::size_t>(part.width);
    const std::span<const std::int16_t> all = view.values.span();
    std::vector<std::int16_t> values;
    values.reserve(area(part) * rank);
    for (int r = 0; r < part.height; ++r) {
        const std::size_t first = static_cast<std::size_t>(row + r) * static_cast<std::size_t>(size.width) +
                                  static_cast<std::size_t>(column);
        const auto from = all.subspan(first * rank, width * rank);
        values.insert(values.end(), from.begin(), from.end());
    }
    result.values = SharedNumbers(std::move(values));
    return result;
}

}  // namespace btfield::detail
