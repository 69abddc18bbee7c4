#pragma once

// Products and factors of matrices of middling size, at the processor's full width: what Eigen gives is
// compiled for the narrowest that the library runs on.

#include "host/base/eigen.hpp"

namespace btfield::detail {

/// Rows apart by any stride.
using ConstRows = Eigen::Ref<const RowMajorMatrix, 0, Eigen::OuterStride<>>;
using Rows = Eigen::Ref<RowMajorMatrix, 0, Eigen::OuterStride<>>;

/// c += a b. Precondition: c overlaps neither a nor b.
void add_product(const ConstRows& a, const ConstRows& b, Rows c);

// Small products, compiled once: each that is written out takes a compiler half a second.
/// a b c
[[nodiscard]] Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b,
                                      const Eigen::MatrixXd& c);
/// a b
[[nodiscard]] Eigen::MatrixXcd product(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b);
/// a m aᵀ
[[nodiscard]] Eigen::MatrixXd congruent(const Eigen::MatrixXd& a, const Eigen::MatrixXd& m);

/// H = L Lᵀ.
class Cholesky {
  public:
    /// Reads the lower triangle.
    explicit Cholesky(const Eigen::MatrixXd& matrix);
    /// False where H is not positive definite: there is nothing to solve with then.
    [[nodiscard]] bool positive() const { return positive_; }
    /// H⁻¹ b
    [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& b) const;

  private:
    RowMajorMatrix factor_;  ///< its lower triangle
    bool positive_ = true;
};

}  // namespace btfield::detail
