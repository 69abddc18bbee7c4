#pragma once

// Decompositions that each cost a compiler seconds, behind functions of matrices whose size is known at run
// time only.

#include <optional>

#include "host/base/eigen.hpp"

namespace btfield::detail {

/// x of least |a x − b|, and among these of least |x|.
/// \param threshold relative to the largest pivot, below which a pivot counts as zero; without it, rounding
///     decides
[[nodiscard]] Eigen::VectorXd least_norm_solution(const Eigen::MatrixXd& a, const Eigen::VectorXd& b,
                                                  std::optional<double> threshold = {});

/// U, upper triangular, of a = Q U with QᵀQ = I. Precondition: a is square.
[[nodiscard]] Eigen::MatrixXd upper_factor(const Eigen::MatrixXd& a);

/// Q of a = Q U with QᵀQ = I, of the size of a: where columns depend on those before them, any that are
/// orthogonal to these. Precondition: a has no fewer rows than columns.
[[nodiscard]] RowMajorMatrix orthonormal_columns(const RowMajorMatrix& a);

/// The largest |eigenvalue|; infinite where a holds what is not finite, or where no eigenvalues are found.
[[nodiscard]] double spectral_radius(const Eigen::MatrixXcd& a);

[[nodiscard]] double smallest_singular_value(const Eigen::MatrixXcd& a);

/// Of a Hermitian matrix.
struct HermitianRoot {
    double lowest = 0.0;       ///< eigenvalue
    Eigen::MatrixXcd inverse;  ///< a^{−1/2} where lowest > 0, else empty
};
[[nodiscard]] HermitianRoot hermitian_root(const Eigen::MatrixXcd& a);

}  // namespace btfield::detail
