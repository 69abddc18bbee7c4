#pragma once

// Λ_t and the spectral density S_t of a model, and sums of them over frequency grids (P4 eq. 33, 38).

#include <algorithm>
#include <complex>
#include <functional>
#include <vector>

#include "btfield/lag_covariance.hpp"
#include "btfield/models.hpp"
#include "host/base/eigen.hpp"
#include "host/spectrum/spectral_form.hpp"

namespace btfield::detail {

/// Λ, its inverse and S at several frequencies. Entries of matrices are stored as [entry][re, im][n], so that
/// loops run along n.
class SpectralLanes {
  public:
    SpectralLanes(const SpectralForm& form, int lanes);

    /// S for i <= j, once Λ and its inverse are there.
    void evaluate_density();

    [[nodiscard]] int planes() const { return planes_; }
    [[nodiscard]] int lanes() const { return lanes_; }
    /// Re, then Im of entry i d + j.
    [[nodiscard]] const double* lambda(int entry) const { return lambda_.at(entry); }
    [[nodiscard]] const double* inverse(int entry) const { return inverse_.at(entry); }
    [[nodiscard]] std::complex<double> determinant(int n) const;
    [[nodiscard]] double sum_of_log_determinants() const;  ///< Σ_n ln |det Λ|
    /// ‖Λ⁻¹‖_F, whose inverse bounds σ_min(Λ) from below and, times √d, from above. NaN or infinite when
    /// singular.
    [[nodiscard]] double inverse_norm(int n) const;
    /// Re S_ij, i <= j, [n].
    [[nodiscard]] const double* density(int i, int j) const { return density_.at(i * planes_ + j); }
    /// Row 2 (d i + j) is Re S_ij along n, the next row Im S_ij; rows of i > j are zero.
    [[nodiscard]] Eigen::Map<const RowMajorMatrix> densities() const {
        return {density_.at(0), Eigen::Index{2} * planes_ * planes_, lanes_};
    }

  protected:
    /// Complex values [entry][re, im][n].
    class Values {
      public:
        Values() = default;
        Values(int entries, int lanes)
            : stride_(2 * static_cast<std::size_t>(lanes)),
              values_(static_cast<std::size_t>(entries) * stride_) {}
        [[nodiscard]] double* at(int entry) {
            return values_.data() + static_cast<std::size_t>(entry) * stride_;
        }
        [[nodiscard]] const double* at(int entry) const {
            return values_.data() + static_cast<std::size_t>(entry) * stride_;
        }
        [[nodiscard]] bool empty() const { return values_.empty(); }
        void clear() { std::fill(values_.begin(), values_.end(), 0.0); }

      private:
        std::size_t stride_ = 0;
        std::vector<double> values_;
    };
    [[nodiscard]] Values& lambda_values() { return lambda_; }
    void invert();

  private:
    /// out = a M
    void times_real(const Values& a, const Eigen::MatrixXd& m, Values& out) const;
    /// density_ = X Yᴴ of coloured_ and y, i <= j
    void set_density(const Values& y);

    SpectralForm::Kind kind_;
    int planes_, lanes_;
    Eigen::MatrixXd noise_, left_, right_;  ///< a root of Σ, or Σ itself for mmrf
    Values lambda_, determinant_, inverse_, coloured_, second_, density_;
    std::vector<double> squares_, inverse_squares_;  ///< |det Λ|², ‖Λ⁻¹‖²
};

/// One row of a frequency grid: ω1 fixed. Where Λ is singular its inverse is not finite.
class SpectralRow : public SpectralLanes {
  public:
    /// ω2 = 2π n / columns for n = 0 … columns − 1
    SpectralRow(const SpectralForm& form, int columns);
    /// \param columns ω2
    SpectralRow(const SpectralForm& form, const std::vector<double>& columns);

    /// Λ, its determinant and its inverse.
    void evaluate(double row_frequency);

  private:
    /// \param turn of distinct s2 and n, e^{i s2 ω2}
    void fill_waves(const SpectralForm& form,
                    const std::function<std::complex<double>(int column, int n)>& turn);

    std::vector<Offset> offsets_;
    std::vector<double> coefficients_;
    std::vector<int> column_offsets_;  ///< distinct s2
    RowMajorMatrix waves_;             ///< cos, then sin of s2 ω2, [distinct s2][n]
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
/// own frequencies, zero frequency included. A large grid gives those of the infinite lattice.
/// \throws InputError when a side is < 1 or the box negative
[[nodiscard]] LagCovariance model_covariance(const SpectralForm& form, Size torus, Offset box);

/// The same of all modelled planes of a level as it is grown, with mean_density() where it is certified;
/// those of a 2D level's parts are independent of each other.
[[nodiscard]] LagCovariance level_covariance(const LevelModel& level, Size torus, Offset box, int factor,
                                             int depth);

}  // namespace btfield::detail
