#pragma once

// Bases of the planes in which estimates and certificates are computed (theory 10.2, 11.3 to 11.6).

#include "host/base/eigen.hpp"

namespace btfield::detail {

/// y' = forward · y, y = inverse · y'.
struct WorkingBasis {
    Eigen::MatrixXd forward, inverse;
};

/// How the planes of a working basis come from those of the picture.
enum class Turn {
    none,       ///< each divided by its deviation
    principal,  ///< so, then along the eigenvectors of the correlation: covariance I
    nearest,  ///< so, then by the inverse symmetric root of the correlation: covariance I, each plane as near
              ///< its own as that allows
    rotation,  ///< along the eigenvectors of the covariance, uncorrelated but not scaled: the basis is orthogonal
};

/// What eigenvalues of the correlation (their sum is the number of planes) are raised to before their roots
/// are taken, so that planes that repeat each other leave the basis finite.
struct EigenvalueFloor {
    double absolute = 0.0;
    double relative = 0.0;  ///< to the largest
};

/// \param covariance of the planes, positive diagonal
/// \param floor      for Turn::principal and Turn::nearest
[[nodiscard]] WorkingBasis working_basis(const Eigen::MatrixXd& covariance, Turn turn,
                                         EigenvalueFloor floor = {});

/// Eigenvalues of the planes' correlation, ascending.
[[nodiscard]] Eigen::VectorXd correlation_eigenvalues(const Eigen::MatrixXd& covariance);

}  // namespace btfield::detail
