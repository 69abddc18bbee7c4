#include "host/inverse_spectrum.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

#include "host/parallel.hpp"

namespace btfield {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using std::size_t;
using RowMajor = InverseSpectrum::RowMajor;

Complex root_of_unity(int k, int n) {
    k = ((k % n) + n) % n;
    const double angle = 2.0 * std::numbers::pi * k / n;
    return {std::cos(angle), std::sin(angle)};
}

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

struct Lane {
    const double* real;
    const double* imaginary;
};

Lane lane(const RowMajor& values, Index field) {
    return {values.row(2 * field).data(), values.row(2 * field + 1).data()};
}

/// Inverses by the adjugate, d <= 3, along lanes.
void invert_small(int d, const RowMajor& b, RowMajor& inverse, double* det, double* det_imaginary) {
    const Index count = b.cols();
    const auto entry = [&](int i, int j) { return lane(b, Index{i} * d + j); };
    if (d == 1) {
        inverse.row(0).setOnes();
        inverse.row(1).setZero();
    } else if (d == 2) {
        inverse.middleRows(0, 2) = b.middleRows(6, 2);
        inverse.middleRows(2, 2) = -b.middleRows(2, 2);
        inverse.middleRows(4, 2) = -b.middleRows(4, 2);
        inverse.middleRows(6, 2) = b.middleRows(0, 2);
    } else {
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
                const Lane a = entry(i1, j1), e = entry(i2, j2), c = entry(i1, j2), f = entry(i2, j1);
                double* real = inverse.row(2 * (Index{j} * 3 + i)).data();
                double* imaginary = inverse.row(2 * (Index{j} * 3 + i) + 1).data();
                for (Index n = 0; n < count; ++n) {
                    real[n] = a.real[n] * e.real[n] - a.imaginary[n] * e.imaginary[n] -
                              (c.real[n] * f.real[n] - c.imaginary[n] * f.imaginary[n]);
                    imaginary[n] = a.real[n] * e.imaginary[n] + a.imaginary[n] * e.real[n] -
                                   (c.real[n] * f.imaginary[n] + c.imaginary[n] * f.real[n]);
                }
            }
        }
    }
    std::fill_n(det, count, 0.0);
    std::fill_n(det_imaginary, count, 0.0);
    for (int j = 0; j < d; ++j) {
        const Lane a = entry(0, j), c = lane(inverse, Index{j} * d);
        for (Index n = 0; n < count; ++n) {
            det[n] += a.real[n] * c.real[n] - a.imaginary[n] * c.imaginary[n];
            det_imaginary[n] += a.real[n] * c.imaginary[n] + a.imaginary[n] * c.real[n];
        }
    }
    for (Index e = 0; e < Index{d} * d; ++e) {
        double* real = inverse.row(2 * e).data();
        double* imaginary = inverse.row(2 * e + 1).data();
        for (Index n = 0; n < count; ++n) {
            const double scale = 1.0 / (det[n] * det[n] + det_imaginary[n] * det_imaginary[n]);
            const double re = real[n], im = imaginary[n];
            real[n] = (re * det[n] + im * det_imaginary[n]) * scale;
            imaginary[n] = (im * det[n] - re * det_imaginary[n]) * scale;
        }
    }
}

void invert_general(int d, const RowMajor& b, RowMajor& inverse, double* det, double* det_imaginary) {
    Eigen::MatrixXcd matrix(d, d);
    for (Index n = 0; n < b.cols(); ++n) {
        for (Index e = 0; e < Index{d} * d; ++e) matrix(e / d, e % d) = {b(2 * e, n), b(2 * e + 1, n)};
        const Eigen::PartialPivLU<Eigen::MatrixXcd> lu(matrix);
        const Complex determinant = lu.determinant();
        det[n] = determinant.real();
        det_imaginary[n] = determinant.imag();
        matrix = lu.inverse();
        for (Index e = 0; e < Index{d} * d; ++e) {
            inverse(2 * e, n) = matrix(e / d, e % d).real();
            inverse(2 * e + 1, n) = matrix(e / d, e % d).imag();
        }
    }
}

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
            const Complex turn = root_of_unity(columns_[static_cast<size_t>(c)] * n, side);
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
        const Complex turn = root_of_unity(terms_[s].row * m, side_);
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
    values.noalias() = rows * waves_;
    RowMajor& inverse = inverse_[static_cast<size_t>(m)];
    sums.determinant.resize(2 * static_cast<size_t>(side_));
    double* det = sums.determinant.data();
    double* det_imaginary = det + side_;
    if (planes_ <= 3) {
        invert_small(planes_, values, inverse, det, det_imaginary);
    } else {
        invert_general(planes_, values, inverse, det, det_imaginary);
    }
    double logarithm = 0.0;
    for (int n = 0; n < side_; ++n) {
        logarithm += std::log(det[n] * det[n] + det_imaginary[n] * det_imaginary[n]);
        sums.positive = sums.positive && det[n] > 0.0;
    }
    const double weight = row_weight(m, side_);
    sums.log_determinant += 0.5 * weight * logarithm;
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
            const Complex turn = root_of_unity(c * n, side_);
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
            sums.noalias() = values * table;
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
                const Complex turn = root_of_unity(m * s1, side_);
                turns(s1 + box.row, 2 * k) = weight * turn.real();
                turns(s1 + box.row, 2 * k + 1) = -weight * turn.imag();
            }
        }
        partial[static_cast<size_t>(block)].noalias() = turns * along;
    });
    RowMajor total = RowMajor::Zero(lag_rows, lag_columns * fields);
    for (const RowMajor& sums : partial) total += sums;
    total /= static_cast<double>(side_) * side_;
    return Eigen::Map<const RowMajor>(total.data(), lag_rows * lag_columns, fields);
}

}  // namespace btfield
