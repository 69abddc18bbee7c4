#pragma once

// F_t = scale · Λ_t⁻¹ Σ^{1/2} at one frequency, in float64 (theory 14.3; P4 eq. 33).

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>

#include "btfield/image.hpp"
#include "btfield/models.hpp"

namespace btfield::reference {

/// λ_{t,ij} = δ_ij − Σ_s a_{s,i,j} exp(√−1 ω_st), ω_st = 2π (ky s1/H + kx s2/W).
inline Eigen::MatrixXcd transfer_matrix(const LinearField& field, Size lattice, int kx, int ky) {
    const int d = field.planes;
    Eigen::MatrixXcd lambda = Eigen::MatrixXcd::Identity(d, d);
    for (std::size_t s = 0; s < field.offsets.size(); ++s) {
        const double turns = static_cast<double>(ky) * field.offsets[s].row / lattice.height +
                             static_cast<double>(kx) * field.offsets[s].column / lattice.width;
        const std::complex<double> wave = std::polar(1.0, 2.0 * std::numbers::pi * turns);
        for (int i = 0; i < d; ++i)
            for (int j = 0; j < d; ++j)
                lambda(i, j) -=
                    field.coefficients[(s * static_cast<std::size_t>(d) + static_cast<std::size_t>(i)) *
                                           static_cast<std::size_t>(d) +
                                       static_cast<std::size_t>(j)] *
                    wave;
    }
    return lambda;
}

/// Σ^{1/2}: the lower Cholesky factor.
inline Eigen::MatrixXd noise_root(const LinearField& field) {
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::MatrixXd covariance =
        Eigen::Map<const RowMajor>(field.noise_covariance.data(), field.planes, field.planes);
    return covariance.llt().matrixL();
}

inline Eigen::MatrixXcd spectral_factor(const LinearField& field, Size lattice, double scale, int kx,
                                        int ky) {
    return transfer_matrix(field, lattice, kx, ky)
        .fullPivLu()
        .solve((scale * noise_root(field)).cast<std::complex<double>>());
}

}  // namespace btfield::reference
