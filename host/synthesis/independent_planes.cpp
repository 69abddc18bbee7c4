#include "host/synthesis/independent_planes.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/decompositions.hpp"

namespace btfield::detail {

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
    const MatrixXd upper = upper_factor(root.transpose());
    MatrixXd lower = MatrixXd::Zero(d, d);
    for (int i = 0; i < d; ++i) {
        const double sign = upper(i, i) < 0.0 ? -1.0 : 1.0;
        for (int j = i; j < d; ++j) lower(j, i) = sign * upper(i, j);
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

LinearField joined_planes(std::span<const Model> models) {
    if (models.size() == 1) return linear_field(models.front());
    LinearField joined;
    joined.kind = linear_field(models.front()).kind;
    std::set<Offset> offsets;
    for (const Model& model : models) {
        const LinearField& field = linear_field(model);
        joined.planes += field.planes;
        offsets.insert(field.offsets.begin(), field.offsets.end());
    }
    joined.offsets.assign(offsets.begin(), offsets.end());
    const auto d = static_cast<size_t>(joined.planes);
    joined.coefficients.resize(joined.offsets.size() * d * d);
    joined.noise_covariance.resize(d * d);
    size_t first = 0;
    const auto place = [&](double* target, const double* source, size_t planes) {
        for (size_t i = 0; i < planes; ++i)
            for (size_t j = 0; j < planes; ++j) target[(first + i) * d + first + j] = source[i * planes + j];
    };
    for (const Model& model : models) {
        const LinearField& field = linear_field(model);
        const auto planes = static_cast<size_t>(field.planes);
        for (size_t s = 0; s < field.offsets.size(); ++s) {
            const auto at = std::lower_bound(joined.offsets.begin(), joined.offsets.end(), field.offsets[s]);
            place(joined.coefficients.data() + static_cast<size_t>(at - joined.offsets.begin()) * d * d,
                  field.coefficients.data() + s * planes * planes, planes);
        }
        place(joined.noise_covariance.data(), field.noise_covariance.data(), planes);
        first += planes;
    }
    return joined;
}

}  // namespace btfield::detail
