#pragma once

// Linear algebra of matrices whose size is known at run time only, by Eigen. Each function is compiled once:
// written out in a test, a product takes a compiler a third of a second, a decomposition up to ten seconds.

#include <Eigen/Core>

namespace btfield::reference {

/// a b
[[nodiscard]] Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
[[nodiscard]] Eigen::MatrixXcd product(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b);
[[nodiscard]] Eigen::VectorXd product(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
[[nodiscard]] Eigen::VectorXcd product(const Eigen::MatrixXcd& a, const Eigen::VectorXcd& b);
/// a b c
[[nodiscard]] Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b,
                                      const Eigen::MatrixXd& c);
/// a m aᵀ
[[nodiscard]] Eigen::MatrixXd congruent(const Eigen::MatrixXd& a, const Eigen::MatrixXd& m);

[[nodiscard]] Eigen::MatrixXd inverse(const Eigen::MatrixXd& a);
[[nodiscard]] Eigen::MatrixXcd inverse(const Eigen::MatrixXcd& a);
/// a⁻¹ b, by elimination with full pivoting
[[nodiscard]] Eigen::MatrixXcd solution(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b);

/// L of a = L Lᵀ. Reads the lower triangle.
[[nodiscard]] Eigen::MatrixXd lower_root(const Eigen::MatrixXd& a);
/// ln det of a positive definite matrix. Reads the lower triangle.
[[nodiscard]] double log_determinant(const Eigen::MatrixXcd& a);

/// Symmetric or Hermitian; they read the lower triangle.
[[nodiscard]] Eigen::MatrixXd symmetric_root(const Eigen::MatrixXd& a);
[[nodiscard]] Eigen::MatrixXd symmetric_inverse_root(const Eigen::MatrixXd& a);
[[nodiscard]] Eigen::MatrixXcd hermitian_root(const Eigen::MatrixXcd& a);
[[nodiscard]] Eigen::MatrixXcd hermitian_inverse_root(const Eigen::MatrixXcd& a);

/// x of least |a x − b| of a matrix of full rank
[[nodiscard]] Eigen::VectorXd least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// Of a square matrix, the largest first.
[[nodiscard]] Eigen::VectorXd singular_values(const Eigen::MatrixXcd& a);

/// Q of a = Q R with R upper triangular, of a square matrix
[[nodiscard]] Eigen::MatrixXd orthogonal_factor(const Eigen::MatrixXd& a);
[[nodiscard]] Eigen::MatrixXcd unitary_factor(const Eigen::MatrixXcd& a);

/// b diag(values) b*: with an orthogonal or unitary b, the matrix of these eigenvalues and eigenvectors.
[[nodiscard]] Eigen::MatrixXd with_eigenvalues(const Eigen::MatrixXd& b, const Eigen::VectorXd& values);
[[nodiscard]] Eigen::MatrixXcd with_eigenvalues(const Eigen::MatrixXcd& b, const Eigen::VectorXd& values);

}  // namespace btfield::reference
