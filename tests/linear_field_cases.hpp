#pragma once

// Linear fields with random coefficients for the kernels that work in the picture's own domain.

#include <algorithm>
#include <cmath>
#include <random>

#include "btfield/models.hpp"

namespace btfield::test {

/// Coefficients whose absolute values sum to `sum` in every row of [A_s …], on every offset, and a Σ of
/// correlated planes. `coupled` false: nothing joins two planes.
inline LinearField random_field(const std::vector<Offset>& offsets, int planes, double sum,
                                bool coupled = true, unsigned seed = 5) {
    LinearField field;
    field.planes = planes;
    field.offsets = offsets;
    const auto d = static_cast<std::size_t>(planes);
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    field.coefficients.resize(offsets.size() * d * d);
    for (std::size_t k = 0; k < field.coefficients.size(); ++k) {
        const double value = uniform(generator);
        field.coefficients[k] = coupled || k / d % d == k % d ? value : 0.0;
    }
    for (std::size_t i = 0; i < d; ++i) {
        double total = 0.0;
        for (std::size_t s = 0; s < offsets.size(); ++s)
            for (std::size_t j = 0; j < d; ++j) total += std::abs(field.coefficients[(s * d + i) * d + j]);
        for (std::size_t s = 0; s < offsets.size(); ++s)
            for (std::size_t j = 0; j < d; ++j) field.coefficients[(s * d + i) * d + j] *= sum / total;
    }
    for (std::size_t i = 0; i < d; ++i) {
        for (std::size_t j = 0; j < d; ++j) {
            const double correlation = i == j ? 1.0 : coupled ? 0.6 : 0.0;
            field.noise_covariance.push_back(correlation * (1.0 + 0.1 * static_cast<double>(i)) *
                                             (1.0 + 0.1 * static_cast<double>(j)));
        }
    }
    return field;
}

}  // namespace btfield::test
