#pragma once

// Λ_t and the spectral density S_t of a model, and sums of them over frequency grids (P4 eq. 33, 38).

#include <Eigen/Core>
#include <complex>
#include <functional>
#include <vector>

#include "btfield/lag_covariance.hpp"
#include "btfield/models.hpp"
#include "host/spectral_form.hpp"

namespace btfield {

/// One row of a frequency grid: ω1 fixed, ω2 = 2π n / columns for n = 0 … columns − 1. Entries of matrices
/// are stored as [entry][n], real and imaginary parts apart, so that loops run along n.
class SpectralRow {
  public:
    SpectralRow(const SpectralForm& form, int columns);

    /// Λ, its determinant and its inverse. Where Λ is singular the inverse is not finite.
    void evaluate(double row_frequency);
    /// S for i <= j, after evaluate().
    void evaluate_density();

    [[nodiscard]] int planes() const { return planes_; }
    [[nodiscard]] int columns() const { return columns_; }
    [[nodiscard]] std::complex<double> determinant(int n) const;
    [[nodiscard]] double log_determinant(int n) const;  ///< ln |det Λ|
    /// ‖Λ⁻¹‖_F, whose inverse bounds σ_min(Λ) from below and, times √d, from above. NaN or infinite when
    /// singular.
    [[nodiscard]] double inverse_norm(int n) const;
    /// Re S_ij, i <= j, [n].
    [[nodiscard]] const double* density(int i, int j) const { return density_.real(i * planes_ + j); }
    using DensityRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    /// Row 2 (d i + j) is Re S_ij along n, the next row Im S_ij; rows of i > j are zero.
    [[nodiscard]] Eigen::Map<const DensityRows> densities() const {
        return {density_.real(0), Eigen::Index{2} * planes_ * planes_, columns_};
    }

  private:
    /// Complex values [entry][n].
    class Lanes {
      public:
        Lanes() = default;
        Lanes(int entries, int columns)
            : columns_(static_cast<std::size_t>(columns)),
              values_(2 * static_cast<std::size_t>(entries) * static_cast<std::size_t>(columns)) {}
        [[nodiscard]] double* real(int entry) { return values_.data() + start(entry); }
        [[nodiscard]] double* imaginary(int entry) { return real(entry) + columns_; }
        [[nodiscard]] const double* real(int entry) const { return values_.data() + start(entry); }
        [[nodiscard]] const double* imaginary(int entry) const { return real(entry) + columns_; }

      private:
        [[nodiscard]] std::size_t start(int entry) const {
            return 2 * static_cast<std::size_t>(entry) * columns_;
        }
        std::size_t columns_ = 0;
        std::vector<double> values_;
    };
    void invert_small();
    void invert_general();
    /// density_ = X Xᴴ of coloured_.
    void square_coloured();

    SpectralForm::Kind kind_;
    int planes_, columns_;
    std::vector<Offset> offsets_;
    std::vector<double> coefficients_;
    std::vector<int> column_offsets_;       ///< distinct s2
    std::vector<double> cosine_, sine_;     ///< of s2 ω2, [distinct s2][n]
    Eigen::MatrixXd noise_, left_, right_;  ///< a root of Σ, or Σ itself for mmrf
    Lanes lambda_, determinant_, inverse_, coloured_, second_, density_;
};

/// Means over a grid of frequencies, half of it by symmetry.
struct SpectralMeans {
    Eigen::MatrixXd covariance;    ///< mean_t S_t: the covariance at lag 0
    double log_determinant = 0.0;  ///< mean_t ln |det Λ_t|
};

/// \param grid  rows × columns of the frequency grid
/// \param visit called for every evaluated row m, 0 <= m <= rows / 2, from several threads at a time
[[nodiscard]] SpectralMeans spectral_means(
    const SpectralForm& form, Size grid,
    const std::function<void(int m, const SpectralRow& row)>& visit = {});

/// Covariances of the field on a torus of this size: C_ij(s) = mean_t Re(conj(S_ij(t)) e^{iω_t·s}) over its
/// own frequencies, zero frequency included. A large grid gives those of the infinite lattice. \throws
/// InputError when a side is < 1 or the box negative
[[nodiscard]] LagCovariance model_covariance(const SpectralForm& form, Size torus, Offset box);

/// The same of all modelled planes of a level: those of a 2D level's parts are independent of each other.
[[nodiscard]] LagCovariance level_covariance(const LevelModel& level, Size torus, Offset box);

}  // namespace btfield
