#include "tests/reference/spectral_factor.hpp"

#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>

#include "tests/reference/algebra.hpp"
#include "tests/reference/fields.hpp"

namespace btfield::reference {

Eigen::MatrixXcd transfer_matrix(const LinearField& field, Size lattice, int kx, int ky) {
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

Eigen::MatrixXd noise_root(const LinearField& field) {
    return lower_root(noise_covariance(field));
}

Eigen::MatrixXcd spectral_factor(const LinearField& field, Size lattice, double scale, int kx, int ky) {
    const Eigen::MatrixXcd root = scale * noise_root(field);
    return solution(transfer_matrix(field, lattice, kx, ky), root);
}

Eigen::MatrixXcd mmrf_factor(const Eigen::MatrixXcd& w, const Eigen::MatrixXd& root) {
    return product(Eigen::MatrixXcd(root), hermitian_inverse_root(w));
}

Eigen::MatrixXcd pmrf_factor(const Eigen::MatrixXcd& lambda, const Eigen::MatrixXd& root) {
    return solution(lambda, product(Eigen::MatrixXcd(root), hermitian_root(lambda)));
}

}  // namespace btfield::reference
