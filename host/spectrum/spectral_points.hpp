#pragma once

// Λ with its derivatives, its inverse and S at any frequencies, several at a time.

#include <vector>

#include "host/spectrum/spectral_density.hpp"

namespace btfield::detail {

class SpectralPoints : public SpectralLanes {
  public:
    SpectralPoints(const SpectralForm& form, int lanes);
    SpectralPoints(const SpectralPoints&) = delete;
    SpectralPoints& operator=(const SpectralPoints&) = delete;
    ~SpectralPoints() = default;

    /// Λ, its determinant, its inverse and its derivatives at (rows[n], columns[n]).
    void evaluate(const std::vector<double>& rows, const std::vector<double>& columns);

    /// ‖Λ⁻¹ ∂Λ/∂ω1‖_F and ‖Λ⁻¹ ∂Λ/∂ω2‖_F
    [[nodiscard]] double by_row(int n) const { return by_row_norm_[static_cast<std::size_t>(n)]; }
    [[nodiscard]] double by_column(int n) const { return by_column_norm_[static_cast<std::size_t>(n)]; }

  private:
    struct Term {
        int column = 0;
        const double* coefficient = nullptr;  ///< [i][j], of the form
    };
    struct TermRow {
        int row = 0;
        std::vector<Term> terms;
    };
    using Powers = std::vector<std::vector<double>>;  ///< e^{i k ω}, k = 0, 1, …, [re, im][n]
    /// \return e^{i k ω} from |k|'s, in `spare` where it is a conjugate
    const double* power(const Powers& powers, int k, std::vector<double>& spare) const;
    static void raise(const std::vector<double>& frequencies, Powers& powers);
    void set_norms(const Values& derivative, std::vector<double>& norms);

    std::vector<double> coefficients_;
    std::vector<TermRow> rows_;
    Powers row_powers_, column_powers_;
    Values value_, slope_, by_row_, by_column_, product_;
    std::vector<double> spare_, by_row_norm_, by_column_norm_;
};

}  // namespace btfield::detail
