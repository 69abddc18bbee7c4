#include "host/analysis/marginal_moments.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/base/normal_distribution.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// Terms of the expansion. A kink gives terms a_n of order n^{−5/4}, so that what follows term N of a
/// covariance is of order N^{−3/2}: 2e-4 of (the slope's jump × the density)², which itself is a fraction of
/// the variance.
constexpr int terms = 256;

}  // namespace

double knot(int k, int n) {
    return marginal_reach * (2.0 * k - (n - 1)) / (n - 1);
}

HatMoments hat_moments(int knots, double variance) {
    const auto n = static_cast<size_t>(knots);
    const double deviation = std::sqrt(variance);
    constexpr double infinity = std::numeric_limits<double>::infinity();
    HatMoments hats{std::vector<double>(n), std::vector<double>(n), std::vector<double>(n - 1)};
    const double end = marginal_reach / deviation;
    const double beyond = normal_probability(end, infinity);
    for (const size_t k : {size_t{0}, n - 1}) hats.mean[k] = hats.square[k] = beyond;
    for (size_t k = 0; k + 1 < n; ++k) {
        const double a = knot(static_cast<int>(k), knots) / deviation;
        const double b = knot(static_cast<int>(k) + 1, knots) / deviation;
        // ∫ φ, ∫ (x − a) φ, ∫ (x − a)² φ over [a, b].
        const double zeroth = normal_probability(a, b);
        const double slope = normal_density(a) - normal_density(b);
        const double first = slope - a * zeroth;
        const double second = zeroth - (b - a) * normal_density(b) - a * first;
        const double step = b - a;
        const double up = first / step, up_squared = second / (step * step);
        hats.mean[k + 1] += up;
        hats.mean[k] += zeroth - up;
        hats.square[k + 1] += up_squared;
        hats.square[k] += zeroth - 2.0 * up + up_squared;
        hats.product[k] = up - up_squared;
    }
    return hats;
}

MappedMoments mapped_moments(const Marginal& marginal, const HatMoments& hats) {
    const std::vector<double>& q = marginal.values;
    MappedMoments moments;
    for (size_t k = 0; k < q.size(); ++k) moments.mean += hats.mean[k] * q[k];
    for (size_t k = 0; k < q.size(); ++k) {
        const double c = q[k] - moments.mean;
        moments.variance += hats.square[k] * c * c;
        if (k + 1 < q.size()) moments.variance += 2.0 * hats.product[k] * c * (q[k + 1] - moments.mean);
    }
    return moments;
}

MappedCovariance::MappedCovariance(std::span<const Marginal> marginals, std::span<const double> variances) {
    for (size_t i = 0; i < marginals.size(); ++i) {
        const std::vector<double>& q = marginals[i].values;
        const int n = static_cast<int>(q.size());
        Plane plane;
        plane.deviation = std::sqrt(variances[i]);
        plane.series.assign(terms, 0.0);
        if (!(plane.deviation > 0.0)) {
            plane.mean = quantile(marginals[i], 0.0);
            planes_.push_back(std::move(plane));
            continue;
        }
        const MappedMoments moments = mapped_moments(marginals[i], hat_moments(n, variances[i]));
        plane.mean = moments.mean;
        double slope_before = 0.0;
        for (int k = 0; k < n; ++k) {
            const double t = knot(k, n) / plane.deviation;
            double slope = 0.0;
            if (k + 1 < n) {
                const double after = knot(k + 1, n) / plane.deviation;
                slope = (q[static_cast<size_t>(k) + 1] - q[static_cast<size_t>(k)]) / (after - t);
                plane.series[0] += slope * normal_probability(t, after);  // a_1 = E q'(x)
            }
            // a_n = E q''(x) He_{n−2}(x) / √n!: q'' is a jump of the slope at each knot. The recurrence runs
            // over He_m / √m! times the density.
            double here = (slope - slope_before) * normal_density(t), before = 0.0;
            for (int m = 0; m + 2 <= terms; ++m) {
                plane.series[static_cast<size_t>(m) + 1] += here / std::sqrt((m + 1.0) * (m + 2.0));
                const double next =
                    (t * here - std::sqrt(static_cast<double>(m)) * before) / std::sqrt(m + 1.0);
                before = here;
                here = next;
            }
            slope_before = slope;
        }
        double sum = 0.0;
        for (const double a : plane.series) sum += a * a;
        plane.remainder = std::max(0.0, moments.variance - sum);
        planes_.push_back(std::move(plane));
    }
}

double MappedCovariance::operator()(int i, int j, double c) const {
    const Plane& x = planes_[static_cast<size_t>(i)];
    const Plane& y = planes_[static_cast<size_t>(j)];
    const double scale = x.deviation * y.deviation;
    if (!(scale > 0.0)) return 0.0;
    const double rho = std::clamp(c / scale, -1.0, 1.0);
    // Horner's rule, the last terms first.
    double sum = i == j && rho > 0.0 ? x.remainder * rho : 0.0;
    for (size_t n = terms; n-- > 0;) sum = (sum + x.series[n] * y.series[n]) * rho;
    return sum;
}

std::vector<double> MappedCovariance::operator()(std::span<const double> covariances) const {
    const size_t d = planes_.size();
    std::vector<double> result(covariances.size());
    for (size_t at = 0; at < covariances.size(); ++at) {
        const size_t pair = at % (d * d);
        result[at] = (*this)(static_cast<int>(pair / d), static_cast<int>(pair % d), covariances[at]);
    }
    return result;
}

}  // namespace btfield::detail
