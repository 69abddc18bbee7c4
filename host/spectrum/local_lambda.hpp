#pragma once

// Λ(ω) = I − Σ_s A_s e^{iω·s} at single frequencies, with its derivatives (P4 eq. 38).

#include <algorithm>
#include <complex>
#include <vector>

#include "btfield/models.hpp"
#include "host/base/eigen.hpp"

namespace btfield::detail {

/// \tparam Planes number of planes when known, which spares small matrices the heap, or Eigen::Dynamic
template <int Planes>
class LocalLambda {
  public:
    using Matrix = Eigen::Matrix<std::complex<double>, Planes, Planes>;
    using RealMatrix = Eigen::Matrix<double, Planes, Planes>;

    explicit LocalLambda(const LinearField& field) : planes_(field.planes) {
        for (const Offset s : field.offsets) {
            rows_.push_back(s.row);
            columns_.push_back(s.column);
        }
        unique(rows_);
        unique(columns_);
        const auto block = static_cast<std::size_t>(planes_) * static_cast<std::size_t>(planes_);
        for (std::size_t s = 0; s < field.offsets.size(); ++s) {
            Term term;
            term.offset = field.offsets[s];
            term.row = place(rows_, term.offset.row);
            term.column = place(columns_, term.offset.column);
            term.coefficient.resize(planes_, planes_);
            for (int i = 0; i < planes_; ++i) {
                for (int j = 0; j < planes_; ++j) {
                    term.coefficient(i, j) =
                        field.coefficients[s * block + static_cast<std::size_t>(i * planes_ + j)];
                }
            }
            terms_.push_back(std::move(term));
        }
    }

    struct Term {
        Offset offset;
        std::size_t row = 0, column = 0;  ///< places among the distinct s1, s2
        RealMatrix coefficient;
    };
    [[nodiscard]] const std::vector<Term>& terms() const { return terms_; }
    [[nodiscard]] int planes() const { return planes_; }

    [[nodiscard]] Matrix at(double row_frequency, double column_frequency) const {
        Matrix value = Matrix::Identity(planes_, planes_);
        for_each_term(row_frequency, column_frequency,
                      [&](const Term& term, std::complex<double> turn) { value -= turn * term.coefficient; });
        return value;
    }
    /// Λ, ∂Λ/∂ω1 and ∂Λ/∂ω2.
    void derivatives(double row_frequency, double column_frequency, Matrix& value, Matrix& by_row,
                     Matrix& by_column) const {
        value.setIdentity(planes_, planes_);
        by_row.setZero(planes_, planes_);
        by_column.setZero(planes_, planes_);
        for_each_term(row_frequency, column_frequency, [&](const Term& term, std::complex<double> turn) {
            const std::complex<double> quarter{-turn.imag(), turn.real()};
            value -= turn * term.coefficient;
            if (term.offset.row != 0)
                by_row -= (static_cast<double>(term.offset.row) * quarter) * term.coefficient;
            if (term.offset.column != 0) {
                by_column -= (static_cast<double>(term.offset.column) * quarter) * term.coefficient;
            }
        });
    }

  private:
    static void unique(std::vector<int>& values) {
        std::sort(values.begin(), values.end());
        values.erase(std::unique(values.begin(), values.end()), values.end());
    }
    static std::size_t place(const std::vector<int>& values, int value) {
        return static_cast<std::size_t>(std::lower_bound(values.begin(), values.end(), value) -
                                        values.begin());
    }
    template <class Work>
    void for_each_term(double row_frequency, double column_frequency, const Work& work) const {
        // Few distinct s1 and s2 make up all offsets: their sines and cosines are what costs most.
        thread_local std::vector<std::complex<double>> row_turns, column_turns;
        row_turns.resize(rows_.size());
        column_turns.resize(columns_.size());
        for (std::size_t k = 0; k < rows_.size(); ++k)
            row_turns[k] = std::polar(1.0, row_frequency * rows_[k]);
        for (std::size_t k = 0; k < columns_.size(); ++k) {
            column_turns[k] = std::polar(1.0, column_frequency * columns_[k]);
        }
        for (const Term& term : terms_) {
            const std::complex<double> a = row_turns[term.row], b = column_turns[term.column];
            work(term,
                 {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()});
        }
    }

    int planes_;
    std::vector<int> rows_, columns_;  ///< distinct s1, s2
    std::vector<Term> terms_;
};

}  // namespace btfield::detail
