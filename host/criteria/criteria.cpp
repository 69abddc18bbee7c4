#include "btfield/criteria.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/lag_covariance.hpp"
#include "host/analysis/lag_products.hpp"
#include "host/base/text.hpp"

namespace btfield {

using namespace detail;

namespace {

bool varies(std::span<const float> values) {
    return std::any_of(values.begin(), values.end(), [&](float v) { return v != values.front(); });
}

void check_comparable(const Image& a, const Image& b) {
    const std::string asked = "compare two pictures";
    if (a.planes() < 1 || b.planes() < 1)
        throw InputError(asked, "one of them is empty", "give two pictures");
    if (a.planes() != b.planes()) {
        throw InputError(
            asked,
            "the first has " + counted(a.planes(), "plane") + ", the second " + std::to_string(b.planes()),
            "give pictures with the same number of planes");
    }
    for (int i = 0; i < a.planes(); ++i)
        if (varies(a.plane(i))) return;
    throw InputError(asked, "the first is constant", "give a reference that varies");
}

std::vector<float> sorted(std::span<const float> values) {
    std::vector<float> result(values.begin(), values.end());
    std::ranges::sort(result);
    return result;
}

}  // namespace

Comparison compare(const Image& a, const Image& b) {
    check_comparable(a, b);
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
    std::vector<std::size_t> varying;
    for (std::size_t i = 0; i < d; ++i) {
        Comparison::Plane& p = result.planes[i];
        p.mean = {means_a[i], means_b[i]};
        // Rounding may put the variance of a constant plane below zero. This order of arguments keeps a NaN.
        p.std = {std::sqrt(std::max(cov_a[i * d + i], 0.0)), std::sqrt(std::max(cov_b[i * d + i], 0.0))};
        const bool constant = !varies(a.plane(static_cast<int>(i)));
        p.std_ratio = constant ? std::numeric_limits<double>::quiet_NaN() : p.std[1] / p.std[0];
        if (!constant) varying.push_back(i);
    }

    double error = 0.0;
    for (std::size_t s = 0; s < lags.size(); ++s) {
        for (const std::size_t i : varying) {
            const std::size_t at = (s * d + i) * d + i;
            error += std::abs(cov_a[at] - cov_b[at]) / cov_a[i * d + i];
        }
    }
    result.lag_covariance_error = error / static_cast<double>(lags.size() * varying.size());

    double difference = 0.0;
    double reference = 0.0;
    for (std::size_t k = 0; k < d * d; ++k) {
        difference += (cov_a[k] - cov_b[k]) * (cov_a[k] - cov_b[k]);
        reference += cov_a[k] * cov_a[k];
    }
    result.spectral_covariance_error = std::sqrt(difference) / std::sqrt(reference);
    return result;
}

std::vector<double> quantile_errors(const Image& a, const Image& b) {
    check_comparable(a, b);
    std::vector<double> errors;
    errors.reserve(static_cast<std::size_t>(a.planes()));
    for (int p = 0; p < a.planes(); ++p) {
        const std::vector<float> x = sorted(a.plane(p)), y = sorted(b.plane(p));
        const auto n = static_cast<double>(x.size()), m = static_cast<double>(y.size());
        const double mean = std::accumulate(x.begin(), x.end(), 0.0) / n;
        double variance = 0.0, sum = 0.0, u = 0.0;
        for (const float value : x) variance += (value - mean) * (value - mean) / n;
        // Both quantile functions are steps: from one step of either to the next.
        for (std::size_t i = 0, j = 0; i < x.size() && j < y.size();) {
            const double end_x = static_cast<double>(i + 1) / n, end_y = static_cast<double>(j + 1) / m;
            const double end = std::min(end_x, end_y);
            const double difference = static_cast<double>(x[i]) - static_cast<double>(y[j]);
            sum += (end - u) * difference * difference;
            u = end;
            if (end_x <= end) ++i;
            if (end_y <= end) ++j;
        }
        const bool constant = x.front() == x.back();
        errors.push_back(constant ? std::numeric_limits<double>::quiet_NaN() : std::sqrt(sum / variance));
    }
    return errors;
}

}  // namespace btfield
