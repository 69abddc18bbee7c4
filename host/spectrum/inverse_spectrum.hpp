#pragma once

// A matrix polynomial B_t = Σ_s b_s e^{iω_t s} on a square grid of frequencies, its inverse, and means of
// products of entries of the inverse times e^{iω u}: what the likelihood of an MSAR model is made of
// (theory 11.3).

#include <functional>
#include <vector>

#include "btfield/neighbourhood.hpp"
#include "host/base/dense.hpp"
#include "host/base/eigen.hpp"
#include "host/spectrum/half_grid.hpp"
#include "host/spectrum/lag_transform.hpp"

namespace btfield::detail {

class InverseSpectrum {
  public:
    /// \param terms where b_s is; distinct
    /// \param side  even; frequencies are ω = 2π (m, n) / side. Half of them are visited: B_{−t} = conj B_t.
    InverseSpectrum(int planes, std::vector<Offset> terms, int side);

    [[nodiscard]] int side() const { return side_; }

    struct Value {
        double log_determinant = 0.0;  ///< mean_t ln |det B_t|; not finite when some B_t is singular
        Eigen::VectorXd variance;      ///< diagonal of P = mean_t B_t⁻¹ B_t⁻ᴴ
        bool positive = true;          ///< Re det B_t > 0 everywhere
    };
    /// Evaluates B and keeps B⁻¹.
    /// \param b entry (i, j) of b_s at [(s·d + i)·d + j]
    Value evaluate(const Eigen::VectorXd& b);

    /// Fills complex fields of one row of frequencies from B⁻¹ there: rows 2k and 2k + 1 are the real and
    /// imaginary parts of field k along ω2. B⁻¹ has entry (i, j) as field i·d + j.
    using Fill = std::function<void(const RowMajorMatrix& inverse, RowMajorMatrix& fields)>;
    /// mean_t Re(f_k(ω_t) e^{iω_t u}) for lags u of the box; the fields have f(−ω) = conj f(ω). After
    /// evaluate(); fill is called from several threads at a time.
    [[nodiscard]] LagMeans moments(Eigen::Index fields, Offset box, const Fill& fill) const;

  private:
    struct Partial;
    void evaluate_row(int m, const Eigen::VectorXd& b, RowMajorMatrix& values, Partial& sums);

    int planes_, side_;
    std::vector<Offset> terms_;
    RootsOfUnity root_;
    std::vector<int> columns_;             ///< distinct s2
    std::vector<Eigen::Index> place_;      ///< of each term's s2 among them
    RowMajorMatrix waves_;                 ///< cos, then sin of s2 ω2, [distinct s2][n]
    std::vector<RowMajorMatrix> inverse_;  ///< per row m = 0 … side/2
};

}  // namespace btfield::detail
