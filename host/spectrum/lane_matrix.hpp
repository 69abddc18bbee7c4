#pragma once

// Matrices as functions of frequency, one row of a frequency grid at a time.

#include <complex>
#include <cstddef>
#include <vector>

#include "btfield/neighbourhood.hpp"
#include "host/base/eigen.hpp"

namespace btfield::detail {

/// A d × d complex matrix at each of n frequencies, stored as [i][j][re, im][n]: loops run along n.
class LaneMatrix {
  public:
    LaneMatrix() = default;
    LaneMatrix(int planes, std::size_t lanes)
        : planes_(static_cast<std::size_t>(planes)), lanes_(lanes), values_(2 * planes_ * planes_ * lanes) {}
    [[nodiscard]] int planes() const { return static_cast<int>(planes_); }
    [[nodiscard]] std::size_t lanes() const { return lanes_; }
    [[nodiscard]] double* real(int i, int j) { return values_.data() + start(i, j); }
    [[nodiscard]] double* imaginary(int i, int j) { return real(i, j) + lanes_; }
    [[nodiscard]] const double* real(int i, int j) const { return values_.data() + start(i, j); }
    [[nodiscard]] const double* imaginary(int i, int j) const { return real(i, j) + lanes_; }
    /// Upper triangle from the lower one.
    void complete_hermitian();

  private:
    [[nodiscard]] std::size_t start(int i, int j) const {
        return 2 * (static_cast<std::size_t>(i) * planes_ + static_cast<std::size_t>(j)) * lanes_;
    }
    std::size_t planes_ = 0, lanes_ = 0;
    std::vector<double> values_;
};

/// a b
[[nodiscard]] LaneMatrix product(const LaneMatrix& a, const LaneMatrix& b);
/// a b, a the same for every lane
[[nodiscard]] LaneMatrix product(const Eigen::MatrixXd& a, const LaneMatrix& b);
/// a += scale · b
void add(LaneMatrix& a, const LaneMatrix& b, double scale);
/// Σ_n weights[n] Re tr(a b)
[[nodiscard]] double mean_trace(const LaneMatrix& a, const LaneMatrix& b, const std::vector<double>& weights);
/// aᴴ
[[nodiscard]] LaneMatrix adjoint(const LaneMatrix& a);

/// M_t = M_0 − Σ_{s in half} (M_s e^{iω·s} + M_sᵀ e^{−iω·s}), M_0 symmetric: Hermitian for every t.
struct HermitianPolynomial {
    Eigen::MatrixXd centre;              ///< M_0
    std::vector<Offset> offsets;         ///< one of each ±s pair
    std::vector<Eigen::MatrixXd> terms;  ///< M_s

    [[nodiscard]] int planes() const { return static_cast<int>(centre.rows()); }
};

/// cos and sin of c ω2 along a row of the grid.
class Waves {
  public:
    Waves(const std::vector<double>& frequencies, int largest);
    [[nodiscard]] const double* cosine(int c) const { return table(2 * c); }
    [[nodiscard]] const double* sine(int c) const { return table(2 * c + 1); }

  private:
    [[nodiscard]] const double* table(int k) const {
        return values_.data() + static_cast<std::size_t>(k) * lanes_;
    }
    std::size_t lanes_;
    std::vector<double> values_;
};

/// Lower triangle and diagonal of M_t along the row ω1. Precondition: waves reach the offsets' largest
/// |column|.
void evaluate(const HermitianPolynomial& polynomial, double row_frequency, const Waves& waves,
              LaneMatrix& result);

/// In: Hermitian, lower triangle. Out: all of its inverse; ln det is added to log_determinant, [n].
/// \return false where some matrix is not positive definite; the results then mean nothing
[[nodiscard]] bool invert_positive(LaneMatrix& matrix, double* log_determinant);
/// The same without the inverse; spoils the matrix.
[[nodiscard]] bool factorise_positive(LaneMatrix& matrix, double* log_determinant);

}  // namespace btfield::detail
