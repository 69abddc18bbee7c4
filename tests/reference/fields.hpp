#pragma once

// Linear fields on small tori by plain linear algebra (P4 eq. 20-25): every pixel and plane is one row of a
// matrix.

#include <Eigen/Dense>
#include <cstddef>
#include <random>
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

/// Σ_Y = Ψ⁻¹ Σ_ε Ψ⁻ᵀ, Ψ Y = ε.
inline Eigen::MatrixXd field_covariance(const LinearField& field, Size size) {
    const Eigen::Index count = static_cast<Eigen::Index>(area(size)) * field.planes;
    Eigen::MatrixXd psi = Eigen::MatrixXd::Identity(count, count);
    Eigen::MatrixXd sigma = Eigen::MatrixXd::Zero(count, count);
    for (int row = 0; row < size.height; ++row) {
        for (int column = 0; column < size.width; ++column) {
            for (int i = 0; i < field.planes; ++i) {
                for (int j = 0; j < field.planes; ++j) {
                    sigma(place(size, i, row, column), place(size, j, row, column)) = noise(field, i, j);
                    for (std::size_t s = 0; s < field.offsets.size(); ++s) {
                        psi(place(size, i, row, column),
                            place(size, j, row + field.offsets[s].row, column + field.offsets[s].column)) -=
                            coefficient(field, s, i, j);
                    }
                }
            }
        }
    }
    const Eigen::MatrixXd inverse = psi.inverse();
    return inverse * sigma * inverse.transpose();
}

/// mean_r Cov(y_i(r), y_j(r ⊕ s)) of a stacked covariance.
inline double lag_covariance(const Eigen::MatrixXd& covariance, Size size, int i, int j, Offset s) {
    double sum = 0.0;
    for (int row = 0; row < size.height; ++row) {
        for (int column = 0; column < size.width; ++column) {
            sum += covariance(place(size, i, row, column), place(size, j, row + s.row, column + s.column));
        }
    }
    return sum / static_cast<double>(area(size));
}

/// Field with random coefficients whose absolute row sums stay below `strength` < 1, so that Λ is diagonally
/// dominant, and a random full Σ.
inline LinearField random_field(int planes, const std::vector<Offset>& offsets, double strength,
                                unsigned seed) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    LinearField field;
    field.planes = planes;
    field.offsets = offsets;
    const double scale = strength / (static_cast<double>(offsets.size()) * planes);
    for (std::size_t k = 0; k < offsets.size() * static_cast<std::size_t>(planes * planes); ++k) {
        field.coefficients.push_back(scale * uniform(engine));
    }
    Eigen::MatrixXd root(planes, planes);
    for (double& value : root.reshaped()) value = uniform(engine);
    const Eigen::MatrixXd sigma = root * root.transpose() + 0.3 * Eigen::MatrixXd::Identity(planes, planes);
    for (int i = 0; i < planes; ++i) {
        for (int j = 0; j < planes; ++j) field.noise_covariance.push_back(sigma(i, j));
    }
    return field;
}

/// Single-plane field with unit noise.
inline LinearField scalar_field(const std::vector<Offset>& offsets, const std::vector<double>& coefficients) {
    LinearField field;
    field.planes = 1;
    field.offsets = offsets;
    field.coefficients = coefficients;
    field.noise_covariance = {1.0};
    return field;
}

}  // namespace btfield::reference
