#include "host/independent_planes.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <cmath>
#include <utility>

#include "btfield/error.hpp"

namespace btfield {

using Eigen::MatrixXd;
using std::size_t;

MatrixXd noise_root(const LinearField& field) {
    const int d = field.planes;
    MatrixXd covariance(d, d);
    for (int i = 0; i < d; ++i) {
        for (int j = 0; j < d; ++j) {
            const int place = i * d + j;
            covariance(i, j) = field.noise_covariance[static_cast<size_t>(place)];
        }
    }
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(covariance);
    const Eigen::VectorXd& values = solver.eigenvalues();
    if (!(values.minCoeff() >= -1e-9 * values.maxCoeff())) {
        throw InputError("take the root of the noise covariance", "it has a negative eigenvalue",
                         "fit the model again");
    }
    // Σ = R Rᵀ with R = V D^{1/2}; Rᵀ = Q U gives Σ = Uᵀ U.
    const MatrixXd root = solver.eigenvectors() * values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
    const Eigen::HouseholderQR<MatrixXd> qr(root.transpose());
    MatrixXd lower = MatrixXd::Zero(d, d);
    for (int i = 0; i < d; ++i) {
        const double sign = qr.matrixQR()(i, i) < 0.0 ? -1.0 : 1.0;
        for (int j = i; j < d; ++j) lower(j, i) = sign * qr.matrixQR()(i, j);
    }
    return lower;
}

std::vector<LinearField> independent_planes(const LinearField& field) {
    const auto d = static_cast<size_t>(field.planes);
    const auto couples = [&](const std::vector<double>& values) {
        for (size_t k = 0; k < values.size(); ++k) {
            if (k / d % d != k % d && values[k] != 0.0) return true;
        }
        return false;
    };
    if (d == 1 || couples(field.coefficients) || couples(field.noise_covariance)) return {field};
    std::vector<LinearField> parts;
    for (size_t i = 0; i < d; ++i) {
        LinearField part;
        part.planes = 1;
        part.kind = field.kind;
        part.offsets = field.offsets;
        for (size_t s = 0; s < field.offsets.size(); ++s)
            part.coefficients.push_back(field.coefficients[(s * d + i) * d + i]);
        part.noise_covariance = {field.noise_covariance[i * d + i]};
        parts.push_back(std::move(part));
    }
    return parts;
}

}  // namespace btfield
