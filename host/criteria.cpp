#include "btfield/criteria.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>

#include "btfield/error.hpp"
#include "btfield/lag_covariance.hpp"
#include "host/lag_products.hpp"

namespace btfield {

Comparison compare(const Image& a, const Image& b) {
    const std::string asked = "compare two pictures";
    if (a.planes() < 1 || b.planes() < 1)
        throw InputError(asked, "one of them is empty", "give two pictures");
    if (a.planes() != b.planes()) {
        throw InputError(asked,
                         "the first has " + std::to_string(a.planes()) + " planes, the second " +
                             std::to_string(b.planes()),
                         "give pictures with the same number of planes");
    }
    for (int i = 0; i < a.planes(); ++i) {
        const auto values = a.plane(i);
        const auto [low, high] = std::minmax_element(values.begin(), values.end());
        if (*low == *high) {
            throw InputError(asked, "plane " + std::to_string(i) + " of the first is constant",
                             "give a reference whose every plane varies");
        }
    }
    // What fits in both sides of both pictures; (0, 0) stays first.
    const std::vector<Offset> lags =
        probe_lags({std::min(a.height(), b.height()), std::min(a.width(), b.width())});
    const std::vector<double> cov_a = covariances_at(a, lags);
    const std::vector<double> cov_b = covariances_at(b, lags);
    const std::vector<double> means_a = plane_means(a);
    const std::vector<double> means_b = plane_means(b);
    const auto d = static_cast<std::size_t>(a.planes());

    Comparison result;
    result.planes.resize(d);
    for (std::size_t i = 0; i < d; ++i) {
        Comparison::Plane& p = result.planes[i];
        p.mean = {means_a[i], means_b[i]};
        // Rounding may put the variance of a constant plane below zero. This order of arguments keeps a NaN.
        p.std = {std::sqrt(std::max(cov_a[i * d + i], 0.0)), std::sqrt(std::max(cov_b[i * d + i], 0.0))};
        p.std_ratio = p.std[1] / p.std[0];
    }

    double error = 0.0;
    for (std::size_t s = 0; s < lags.size(); ++s) {
        for (std::size_t i = 0; i < d; ++i) {
            const std::size_t at = (s * d + i) * d + i;
            error += std::abs(cov_a[at] - cov_b[at]) / cov_a[i * d + i];
        }
    }
    result.lag_covariance_error = error / static_cast<double>(lags.size() * d);

    double difference = 0.0;
    double reference = 0.0;
    for (std::size_t k = 0; k < d * d; ++k) {
        difference += (cov_a[k] - cov_b[k]) * (cov_a[k] - cov_b[k]);
        reference += cov_a[k] * cov_a[k];
    }
    result.spectral_covariance_error = std::sqrt(difference) / std::sqrt(reference);
    return result;
}

}  // namespace btfield
