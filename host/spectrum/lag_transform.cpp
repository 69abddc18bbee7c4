#include "host/spectrum/lag_transform.hpp"

#include <cmath>

#include "host/spectrum/half_grid.hpp"

namespace btfield::detail {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using std::size_t;

}  // namespace

LagTransform::LagTransform(const FrequencyGrid& grid, Offset box)
    : box_(box), waves_(static_cast<Index>(grid.column.size()), Index{2} * (box.column + 1)) {
    for (size_t n = 0; n < grid.column.size(); ++n) {
        for (int c = 0; c <= box.column; ++c) {
            const auto row = static_cast<Index>(n);
            waves_(row, c) = grid.column_weight[n] * std::cos(c * grid.column[n]);
            waves_(row, c + box.column + 1) = grid.column_weight[n] * std::sin(c * grid.column[n]);
        }
    }
    for (size_t m = 0; m < grid.row.size(); ++m) {
        for (int r = -box.row; r <= box.row; ++r)
            turns_.push_back(grid.row_weight[m] * std::polar(1.0, grid.row[m] * r));
    }
}

LagTransform::LagTransform(Size grid, Offset box)
    : box_(box),
      frequencies_(static_cast<double>(grid.height) * grid.width),
      waves_(grid.width, Index{2} * (box.column + 1)) {
    const RootsOfUnity column_roots(grid.width), row_roots(grid.height);
    for (int n = 0; n < grid.width; ++n) {
        for (int c = 0; c <= box.column; ++c) {
            const Complex turn = column_roots(static_cast<long long>(c) * n);
            waves_(n, c) = turn.real();
            waves_(n, c + box.column + 1) = turn.imag();
        }
    }
    for (int m = 0; m < half_rows(grid.height); ++m) {
        const double weight = row_weight(m, grid.height);
        for (int r = -box.row; r <= box.row; ++r)
            turns_.push_back(weight * row_roots(static_cast<long long>(m) * r));
    }
}

LagSums::LagSums(const LagTransform& transform, Index functions, int rows)
    : transform_(&transform), functions_(functions), capacity_(rows) {}

void LagSums::add(size_t m, const ConstRows& values) {
    const Offset box = transform_->box_;
    const Index lag_rows = transform_->rows(), k = filled_++;
    if (k == 0) {
        along_.resize(2 * capacity_, transform_->columns() * functions_);
        turns_.resize(lag_rows, 2 * capacity_);
    }
    columns_.setZero(values.rows(), transform_->waves_.cols());
    add_product(values, transform_->waves_, columns_);
    for (int c = -box.column; c <= box.column; ++c) {
        const Index cosine = c < 0 ? -c : c, sine = cosine + box.column + 1;
        const double sign = c < 0 ? -1.0 : 1.0;
        double* const real = &along_(2 * k, (c + box.column) * functions_);
        double* const imaginary = &along_(2 * k + 1, (c + box.column) * functions_);
        for (Index f = 0; f < functions_; ++f) {
            real[f] = columns_(2 * f, cosine) - sign * columns_(2 * f + 1, sine);
            imaginary[f] = columns_(2 * f + 1, cosine) + sign * columns_(2 * f, sine);
        }
    }
    const Complex* const turn = transform_->turns_.data() + m * static_cast<size_t>(lag_rows);
    for (Index r = 0; r < lag_rows; ++r) {
        turns_(r, 2 * k) = turn[r].real();
        turns_(r, 2 * k + 1) = -turn[r].imag();
    }
    if (filled_ == capacity_) complete();
}

void LagSums::complete() {
    if (sums_.size() == 0) sums_.setZero(transform_->rows(), transform_->columns() * functions_);
    if (filled_ == 0) return;
    add_product(turns_.leftCols(2 * filled_), along_.topRows(2 * filled_), sums_);
    filled_ = 0;
    along_.resize(0, 0);
}

LagMeans means_of(std::vector<LagSums>& parts) {
    const LagTransform& transform = *parts.front().transform_;
    for (LagSums& part : parts) part.complete();
    RowMajorMatrix total = std::move(parts.front().sums_);
    for (size_t k = 1; k < parts.size(); ++k) total += parts[k].sums_;
    total /= transform.frequencies_;
    return {std::move(total), transform.box_};
}

}  // namespace btfield::detail
