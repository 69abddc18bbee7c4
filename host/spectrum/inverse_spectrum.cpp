#include "host/spectrum/inverse_spectrum.hpp"

#include <algorithm>
#include <complex>
#include <utility>

#include "host/base/dense.hpp"
#include "host/base/lane_inverse.hpp"
#include "host/base/parallel.hpp"

namespace btfield::detail {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using std::size_t;

// What a block of rows adds up is large.
constexpr int most_blocks = 12;

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
      root_(side),
      inverse_(static_cast<size_t>(half_rows(side)), RowMajorMatrix(2 * Index{planes} * planes, side)) {
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
            const Complex turn = root_(static_cast<long long>(columns_[static_cast<size_t>(c)]) * n);
            waves_(c, n) = turn.real();
            waves_(c + distinct, n) = turn.imag();
        }
    }
}

void InverseSpectrum::evaluate_row(int m, const Eigen::VectorXd& b, RowMajorMatrix& values, Partial& sums) {
    const Index entries = Index{planes_} * planes_, distinct = static_cast<Index>(columns_.size());
    // Σ over terms with the same s2 of b_s e^{iω1 s1}: what is left is a sum over few distinct s2.
    RowMajorMatrix rows = RowMajorMatrix::Zero(2 * entries, 2 * distinct);
    for (size_t s = 0; s < terms_.size(); ++s) {
        const Complex turn = root_(static_cast<long long>(terms_[s].row) * m);
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
    RowMajorMatrix& inverse = inverse_[static_cast<size_t>(m)];
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
    const RowBlocks blocks(half_rows(side_), most_blocks);
    std::vector<Partial> partial(static_cast<size_t>(blocks.count));
    for_each_block(blocks.count, [&](int block) {
        Partial& sums = partial[static_cast<size_t>(block)];
        sums.variance.setZero(planes_);
        RowMajorMatrix values(2 * Index{planes_} * planes_, side_);
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

LagMeans InverseSpectrum::moments(Index fields, Offset box, const Fill& fill) const {
    const LagTransform transform(Size{side_, side_}, box);
    const RowBlocks blocks(half_rows(side_), most_blocks);
    std::vector<LagSums> parts(static_cast<size_t>(blocks.count),
                               LagSums(transform, fields, blocks.per_block));
    for_each_block(blocks.count, [&](int block) {
        RowMajorMatrix values(2 * fields, side_);
        for (int m = blocks.first(block); m < blocks.last(block); ++m) {
            fill(inverse_[static_cast<size_t>(m)], values);
            parts[static_cast<size_t>(block)].add(static_cast<size_t>(m), values);
        }
    });
    return means_of(parts);
}

}  // namespace btfield::detail
