#pragma once

// Linear fields on small tori by plain linear algebra (P4 eq. 20-25): every pixel and plane is one row of a
// matrix.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "btfield/models.hpp"
#include "tests/reference/lag_covariance.hpp"

namespace btfield::reference {

/// Place of plane i at pixel (row, column) in the stacked vector.
inline Eigen::Index place(Size size, int i, int row, int column) {
    return (static_cast<Eigen::Index>(i) * size.height + wrapped(row, size.height)) * size.width +
           wrapped(column, size.width);
}

inline double coefficient(const LinearField& field, std::size_t s, int i, int j) {
    const auto d = static_cast<std::size_t>(field.planes);
    return field.coefficients[(s * d + static_cast<std::size_t>(i)) * d + static_cast<std::size_t>(j)];
}

inline double noise(const LinearField& field, int i, int j) {
    return field.noise_covariance[static_cast<std::size_t>(i * field.planes + j)];
}

/// A_s
Eigen::MatrixXd coefficients(const LinearField& field, std::size_t s);
/// Σ
Eigen::MatrixXd noise_covariance(const LinearField& field);

/// Σ_Y = Ψ⁻¹ Σ_ε Ψ⁻ᵀ, Ψ Y = ε.
Eigen::MatrixXd field_covariance(const LinearField& field, Size size);

/// mean_r Cov(y_i(r), y_j(r ⊕ s)) of a stacked covariance.
double lag_covariance(const Eigen::MatrixXd& covariance, Size size, int i, int j, Offset s);

/// Field with random coefficients whose absolute row sums stay below `strength` < 1, so that Λ is diagonally
/// dominant, and a random full Σ.
LinearField random_field(int planes, const std::vector<Offset>& offsets, double strength, unsigned seed);

/// Single-plane field with unit noise.
LinearField scalar_field(const std::vector<Offset>& offsets, const std::vector<double>& coefficients);

}  // namespace btfield::reference
