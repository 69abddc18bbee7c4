#pragma once

// F_t = scale · Λ_t⁻¹ Σ^{1/2} at one frequency, in float64 (theory 14.3; P4 eq. 33), and what stands for it
// in Markov random fields.

#include <Eigen/Core>

#include "btfield/image.hpp"
#include "btfield/models.hpp"

namespace btfield::reference {

/// λ_{t,ij} = δ_ij − Σ_s a_{s,i,j} exp(√−1 ω_st), ω_st = 2π (ky s1/H + kx s2/W).
Eigen::MatrixXcd transfer_matrix(const LinearField& field, Size lattice, int kx, int ky);

/// Σ^{1/2}: the lower Cholesky factor.
Eigen::MatrixXd noise_root(const LinearField& field);

Eigen::MatrixXcd spectral_factor(const LinearField& field, Size lattice, double scale, int kx, int ky);

/// MMRF: root · W^{-1/2}, W = root⁻¹ Λ root (P4 2.6 up to a unitary factor on the right).
Eigen::MatrixXcd mmrf_factor(const Eigen::MatrixXcd& w, const Eigen::MatrixXd& root);

/// PMRF: Λ⁻¹ root Λ^{1/2} (P4 2.7).
Eigen::MatrixXcd pmrf_factor(const Eigen::MatrixXcd& lambda, const Eigen::MatrixXd& root);

}  // namespace btfield::reference
