#pragma once

// Small complex matrices side by side: entry e of n matrices is n real parts, then n imaginary parts.

#include <cstddef>

namespace btfield::detail {

/// Inverses and determinants of `lanes` matrices of planes × planes, [i][j][re, im][n]; the determinant is
/// [re, im][n]. By the adjugate up to three planes. Not finite where a matrix is singular.
void invert_lanes(int planes, std::size_t lanes, const double* matrix, double* inverse, double* determinant);

/// (re, im) += scale · a b, complex, along the lanes.
void add_lane_product(const double* a, const double* b, double* sum, std::size_t lanes, double scale = 1.0);
/// (re, im) += scale · a conj(b)
void add_lane_conjugate_product(const double* a, const double* b, double* sum, std::size_t lanes,
                                double scale = 1.0);
/// (re, im) = a b
void set_lane_product(const double* a, const double* b, double* product, std::size_t lanes);
/// values *= factors, real factors
void scale_lanes(const double* factors, double* values, std::size_t lanes);
/// sum += factor · values
void add_scaled(double factor, const double* values, double* sum, std::size_t count);

/// Σ ln v. Values are multiplied before logarithms are taken, as far as the product stays in range.
[[nodiscard]] double sum_of_logarithms(const double* values, std::size_t count);
/// sums += re² + im² of `lanes` complex values
void add_squared_moduli(const double* values, double* sums, std::size_t lanes);

}  // namespace btfield::detail
