#include "host/spectrum/spectral_points.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>

#include "host/base/lane_inverse.hpp"

namespace btfield::detail {

using std::size_t;

SpectralPoints::SpectralPoints(const SpectralForm& form, int lanes)
    : SpectralLanes(form, lanes),
      coefficients_(form.lambda.coefficients),
      value_(planes() * planes(), lanes),
      slope_(planes() * planes(), lanes),
      by_row_(planes() * planes(), lanes),
      by_column_(planes() * planes(), lanes),
      product_(1, lanes),
      spare_(2 * static_cast<size_t>(lanes)),
      by_row_norm_(static_cast<size_t>(lanes)),
      by_column_norm_(static_cast<size_t>(lanes)) {
    const auto block = static_cast<size_t>(planes()) * static_cast<size_t>(planes());
    std::map<int, std::vector<Term>> by_row;
    int rows = 1, columns = 1;
    for (size_t s = 0; s < form.lambda.offsets.size(); ++s) {
        const Offset offset = form.lambda.offsets[s];
        by_row[offset.row].push_back({offset.column, coefficients_.data() + s * block});
        rows = std::max(rows, std::abs(offset.row));
        columns = std::max(columns, std::abs(offset.column));
    }
    for (auto& [row, terms] : by_row) rows_.push_back({row, std::move(terms)});
    row_powers_.assign(static_cast<size_t>(rows) + 1, std::vector<double>(spare_.size()));
    column_powers_.assign(static_cast<size_t>(columns) + 1, std::vector<double>(spare_.size()));
}

void SpectralPoints::raise(const std::vector<double>& frequencies, Powers& powers) {
    const size_t lanes = frequencies.size();
    for (size_t n = 0; n < lanes; ++n) {
        powers[0][n] = 1.0;
        powers[0][lanes + n] = 0.0;
        powers[1][n] = std::cos(frequencies[n]);
        powers[1][lanes + n] = std::sin(frequencies[n]);
    }
    for (size_t k = 2; k < powers.size(); ++k)
        set_lane_product(powers[k - 1].data(), powers[1].data(), powers[k].data(), lanes);
}

const double* SpectralPoints::power(const Powers& powers, int k, std::vector<double>& spare) const {
    const std::vector<double>& positive = powers[static_cast<size_t>(std::abs(k))];
    if (k >= 0) return positive.data();
    const auto half = static_cast<std::ptrdiff_t>(lanes());
    std::copy_n(positive.begin(), half, spare.begin());
    std::transform(positive.begin() + half, positive.end(), spare.begin() + half,
                   [](double value) { return -value; });
    return spare.data();
}

void SpectralPoints::evaluate(const std::vector<double>& rows, const std::vector<double>& columns) {
    const int entries = planes() * planes();
    const auto count = static_cast<size_t>(lanes());
    raise(rows, row_powers_);
    raise(columns, column_powers_);
    Values& lambda = lambda_values();
    lambda.clear();
    for (int i = 0; i < planes(); ++i) std::fill_n(lambda.at(i * (planes() + 1)), lanes(), 1.0);
    by_row_.clear();
    by_column_.clear();
    for (const TermRow& row : rows_) {
        value_.clear();
        slope_.clear();
        for (const Term& term : row.terms) {
            const double* const wave = power(column_powers_, term.column, spare_);
            for (int e = 0; e < entries; ++e) {
                const double a = term.coefficient[e];
                if (a == 0.0) continue;
                add_scaled(a, wave, value_.at(e), 2 * count);
                if (term.column != 0) add_scaled(a * term.column, wave, slope_.at(e), 2 * count);
            }
        }
        // Derivatives up to a factor of i, which norms do not see.
        const double* const wave = power(row_powers_, row.row, spare_);
        for (int e = 0; e < entries; ++e) {
            add_lane_product(wave, value_.at(e), lambda.at(e), count, -1.0);
            if (row.row != 0) add_lane_product(wave, value_.at(e), by_row_.at(e), count, row.row);
            add_lane_product(wave, slope_.at(e), by_column_.at(e), count);
        }
    }
    invert();
    set_norms(by_row_, by_row_norm_);
    set_norms(by_column_, by_column_norm_);
}

void SpectralPoints::set_norms(const Values& derivative, std::vector<double>& norms) {
    const int d = planes();
    const auto count = static_cast<size_t>(lanes());
    std::fill(norms.begin(), norms.end(), 0.0);
    for (int i = 0; i < d; ++i) {
        for (int j = 0; j < d; ++j) {
            product_.clear();
            for (int k = 0; k < d; ++k)
                add_lane_product(inverse(i * d + k), derivative.at(k * d + j), product_.at(0), count);
            add_squared_moduli(product_.at(0), norms.data(), count);
        }
    }
    for (double& norm : norms) norm = std::sqrt(norm);
}

}  // namespace btfield::detail
