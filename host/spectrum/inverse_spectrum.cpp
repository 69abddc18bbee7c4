#include "host/spectrum/inverse_spectrum.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

#include "host/base/dense.hpp"
#include "host/base/lane_inverse.hpp"
#include "host/base/parallel.hpp"

namespace btfield::detail {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using std::size_t;
using RowMajor = InverseSpectrum::RowMajor;

/// Rows m = 0 … side/2 stand for all.
double row_weight(int row, int side) {
    return row == 0 || 2 * row == side ? 1.0 : 2.0;
}

/// The same division for any number of threads: sums are taken block by block.
struct RowBlocks {
    int rows, per_block, count;
    explicit RowBlocks(int side)
        : rows(side / 2 + 1),
          per_block(std::max(1, (rows + 11) / 12)),
          count((rows + per_block - 1) / per_block) {}
    [[nodiscard]] int first(int block) const { return block * per_block; }
    [[nodiscard]] int last(int block) const { return std::min(rows, (block + 1) * per_block); }
};

}  // namespace

struct InverseSpectrum::Partial {
    double log_determinant = 0.0;
    Eigen::VectorXd variance;
    bool positive = true;
    std::vector<double> determinant;
};

InverseSpectrum::InverseSpectrum(int planes, std::vector<Offset> terms, int side)
    : planes_(planes),
      side_(side),
      terms_(std::move(terms)),
      inverse_(static_cast<size_t>(side / 2 + 1), RowMajor(2 * Index{planes} * planes, side)) {
    for (int k = 0; k < side; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / side;
        roots_.emplace_back(std::cos(angle), std::sin(angle));
    }
    for (const Offset s : terms_) columns_.push_back(s.column);
    std::sort(columns_.begin(), columns_.end());
    columns_.erase(std::unique(columns_.begin(), columns_.end()), columns_.end());
    for (const Offset s : terms_) {
        place_.push_back(std::lower_bound(columns_.begin(), columns_.end(), s.column) - columns_.begin());
    }
    const auto distinct = static_cast<Index>(columns_.size());
    waves_.resize(2 * distinct, side);
    for (Index c = 0; c < distinct; ++c) {
        for (int n = 0; n < side; ++n) {
            const Complex turn = root(columns_[static_cast<size_t>(c)] * n);
            waves_(c, n) = turn.real();
            waves_(c + distinct, n) = turn.imag();
        }
    }
}

void InverseSpectrum::evaluate_row(int m, const Eigen::VectorXd& b, RowMajor& values, Partial& sums) {
    const Index entries = Index{planes_} * planes_, distinct = static_cast<Index>(columns_.size());
    // Σ over terms with the same s2 of b_s e^{iω1 s1}: what is left is a sum over few distinct s2.
    RowMajor rows = RowMajor::Zero(2 * entries, 2 * distinct);
    for (size_t s = 0; s < terms_.size(); ++s) {
        const Complex turn = root(terms_[s].row * m);
        const Index c = place_[s];
        for (Index e = 0; e < entries; ++e) {
            const double value = b[static_cast<Index>(s) * entries + e];
            const double re = value * turn.real(), im = value * turn.imag();
            rows(2 * e, c) += re;
            rows(2 * e, c + distinct) -= im;
            rows(2 * e + 1, c) += im;
            rows(2 * e + 1, c + distinct) += re;
        }
    }
    values.setZero();
    add_product(rows, waves_, values);
    RowMajor& inverse = inverse_[static_cast<size_t>(m)];
    const auto lanes = static_cast<size_t>(side_);
    sums.determinant.resize(3 * lanes);
    double* const det = sums.determinant.data();
    double* const squares = det + 2 * lanes;
    invert_lanes(planes_, lanes, values.data(), inverse.data(), det);
    std::fill_n(squares, lanes, 0.0);
    add_squared_moduli(det, squares, lanes);
    sums.positive = sums.positive && std::all_of(det, det + lanes, [](double value) { return value > 0.0; });
    const double weight = row_weight(m, side_);
    sums.log_determinant += 0.5 * weight * sum_of_logarithms(squares, lanes);
    const Index own = 2 * Index{planes_};
    for (Index i = 0; i < planes_; ++i)
        sums.variance[i] += weight * inverse.middleRows(i * own, own).squaredNorm();
}

InverseSpectrum::Value InverseSpectrum::evaluate(const Eigen::VectorXd& b) {
    const RowBlocks blocks(side_);
    std::vector<Partial> partial(static_cast<size_t>(blocks.count));
    for_each_block(blocks.count, [&](int block) {
        Partial& sums = partial[static_cast<size_t>(block)];
        sums.variance.setZero(planes_);
        RowMajor values(2 * Index{planes_} * planes_, side_);
        for (int m = blocks.first(block); m < blocks.last(block); ++m) evaluate_row(m, b, values, sums);
    });
    Value value;
    value.variance.setZero(planes_);
    for (const Partial& sums : partial) {
        value.log_determinant += sums.log_determinant;
        value.variance += sums.variance;
        value.positive = value.positive && sums.positive;
    }
    const double count = static_cast<double>(side_) * side_;
    value.log_determinant /= count;
    value.variance /= count;
    return value;
}

RowMajor InverseSpectrum::moments(Index fields, Offset box, const Fill& fill) const {
    const Index lag_rows = 2 * Index{box.row} + 1, lag_columns = 2 * Index{box.column} + 1;
    RowMajor table(side_, 2 * (Index{box.column} + 1));
    for (int c = 0; c <= box.column; ++c) {
        for (int n = 0; n < side_; ++n) {
            const Complex turn = root(c * n);
            table(n, c) = turn.real();
            table(n, c + box.column + 1) = turn.imag();
        }
    }
    // Two small transforms in a row, as matrix products: along the columns of the grid, then along its rows.
    const RowBlocks blocks(side_);
    std::vector<RowMajor> partial(static_cast<size_t>(blocks.count));
    for_each_block(blocks.count, [&](int block) {
        const int first = blocks.first(block);
        const Index rows = std::max(0, blocks.last(block) - first);
        RowMajor values(2 * fields, side_), sums(2 * fields, table.cols());
        RowMajor along(2 * rows, lag_columns * fields), turns(lag_rows, 2 * rows);
        for (Index k = 0; k < rows; ++k) {
            const int m = first + static_cast<int>(k);
            fill(inverse_[static_cast<size_t>(m)], values);
            sums.setZero();
            add_product(values, table, sums);
            for (int s2 = -box.column; s2 <= box.column; ++s2) {
                const int cosine = s2 < 0 ? -s2 : s2, sine = cosine + box.column + 1;
                const double sign = s2 < 0 ? -1.0 : 1.0;
                double* real = &along(2 * k, (s2 + box.column) * fields);
                double* imaginary = &along(2 * k + 1, (s2 + box.column) * fields);
                for (Index f = 0; f < fields; ++f) {
                    real[f] = sums(2 * f, cosine) - sign * sums(2 * f + 1, sine);
                    imaginary[f] = sums(2 * f + 1, cosine) + sign * sums(2 * f, sine);
                }
            }
            const double weight = row_weight(m, side_);
            for (int s1 = -box.row; s1 <= box.row; ++s1) {
                const Complex turn = root(m * s1);
                turns(s1 + box.row, 2 * k) = weight * turn.real();
                turns(s1 + box.row, 2 * k + 1) = -weight * turn.imag();
            }
        }
        RowMajor& own = partial[static_cast<size_t>(block)];
        own.setZero(lag_rows, along.cols());
        add_product(turns, along, own);
    });
    RowMajor total = RowMajor::Zero(lag_rows, lag_columns * fields);
    for (const RowMajor& sums : partial) total += sums;
    total /= static_cast<double>(side_) * side_;
    return Eigen::Map<const RowMajor>(total.data(), lag_rows * lag_columns, fields);
}

}  // namespace btfield::detail
