#include "tests/reference/fields.hpp"

#include <random>

#include "tests/reference/algebra.hpp"

namespace btfield::reference {

Eigen::MatrixXd coefficients(const LinearField& field, std::size_t s) {
    Eigen::MatrixXd a(field.planes, field.planes);
    for (int i = 0; i < field.planes; ++i) {
        for (int j = 0; j < field.planes; ++j) a(i, j) = coefficient(field, s, i, j);
    }
    return a;
}

Eigen::MatrixXd noise_covariance(const LinearField& field) {
    Eigen::MatrixXd sigma(field.planes, field.planes);
    for (int i = 0; i < field.planes; ++i) {
        for (int j = 0; j < field.planes; ++j) sigma(i, j) = noise(field, i, j);
    }
    return sigma;
}

Eigen::MatrixXd field_covariance(const LinearField& field, Size size) {
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
    return congruent(inverse(psi), sigma);
}

double lag_covariance(const Eigen::MatrixXd& covariance, Size size, int i, int j, Offset s) {
    double sum = 0.0;
    for (int row = 0; row < size.height; ++row) {
        for (int column = 0; column < size.width; ++column) {
            sum += covariance(place(size, i, row, column), place(size, j, row + s.row, column + s.column));
        }
    }
    return sum / static_cast<double>(area(size));
}

LinearField random_field(int planes, const std::vector<Offset>& offsets, double strength, unsigned seed) {
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
    const Eigen::MatrixXd sigma =
        product(root, Eigen::MatrixXd(root.transpose())) + 0.3 * Eigen::MatrixXd::Identity(planes, planes);
    for (int i = 0; i < planes; ++i) {
        for (int j = 0; j < planes; ++j) field.noise_covariance.push_back(sigma(i, j));
    }
    return field;
}

LinearField scalar_field(const std::vector<Offset>& offsets, const std::vector<double>& coefficients) {
    LinearField field;
    field.planes = 1;
    field.offsets = offsets;
    field.coefficients = coefficients;
    field.noise_covariance = {1.0};
    return field;
}

}  // namespace btfield::reference
