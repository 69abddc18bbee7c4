#include "host/analysis/expansion.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "btfield/pyramid.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

int power(int base, int exponent) {
    int result = 1;
    for (int k = 0; k < exponent; ++k) result *= base;
    return result;
}

/// R(u) for u = 0 … length − 1.
std::vector<double> autocorrelation(const std::vector<double>& e) {
    std::vector<double> r(e.size());
    for (size_t u = 0; u < e.size(); ++u) {
        for (size_t k = 0; k + u < e.size(); ++k) r[u] += e[k] * e[k + u];
    }
    return r;
}

/// Numbers m with |s − N m| < length, and R(s − N m) of each.
struct Taps {
    int first = 0;
    std::vector<double> weights;
    Taps(int s, int step, const std::vector<double>& r) {
        const int reach = static_cast<int>(r.size()) - 1;
        // Smallest m with N m >= s − reach.
        const int low = s - reach;
        first = low >= 0 ? (low + step - 1) / step : -((-low) / step);
        for (int m = first; step * m <= s + reach; ++m) {
            weights.push_back(r[static_cast<size_t>(std::abs(s - step * m))]);
        }
    }
};

}  // namespace

std::vector<double> composed_expand_kernel(int factor, int depth) {
    std::vector<double> one = pyramid_kernel(factor);
    for (double& w : one) w *= factor;
    std::vector<double> composed = {1.0};
    for (int k = 0; k < depth; ++k) {
        // The next coarser expansion's kernel with n^k − 1 zeros between its taps.
        const auto step = static_cast<size_t>(power(factor, k));
        std::vector<double> longer(composed.size() + step * (one.size() - 1));
        for (size_t a = 0; a < composed.size(); ++a) {
            for (size_t b = 0; b < one.size(); ++b) longer[a + step * b] += composed[a] * one[b];
        }
        composed = std::move(longer);
    }
    return composed;
}

std::vector<double> expansion_weights(int factor, int depth) {
    const auto step = static_cast<size_t>(power(factor, depth));
    const std::vector<double> r = autocorrelation(composed_expand_kernel(factor, depth));
    std::vector<double> weights;
    for (size_t u = 0; u < r.size(); u += step) weights.push_back(r[u] / static_cast<double>(step));
    return weights;
}

Offset expansion_box(int factor, int depth, std::span<const Offset> lags) {
    const int step = power(factor, depth);
    const int reach = static_cast<int>(composed_expand_kernel(factor, depth).size()) - 1;
    Offset box;
    for (const Offset s : lags) {
        box.row = std::max(box.row, (std::abs(s.row) + reach) / step);
        box.column = std::max(box.column, (std::abs(s.column) + reach) / step);
    }
    return box;
}

std::vector<double> expanded_covariance(const LagCovariance& level, int factor, int depth,
                                        std::span<const Offset> lags) {
    const int step = power(factor, depth), d = level.planes();
    const std::vector<double> r = autocorrelation(composed_expand_kernel(factor, depth));
    const double scale = 1.0 / (static_cast<double>(step) * step);
    std::vector<double> result;
    result.reserve(lags.size() * static_cast<size_t>(d) * static_cast<size_t>(d));
    for (const Offset s : lags) {
        const Taps rows(s.row, step, r), columns(s.column, step, r);
        for (int i = 0; i < d; ++i) {
            for (int j = 0; j < d; ++j) {
                double sum = 0.0;
                for (size_t a = 0; a < rows.weights.size(); ++a) {
                    double along = 0.0;
                    for (size_t b = 0; b < columns.weights.size(); ++b) {
                        along += columns.weights[b] * level(i, j,
                                                            {rows.first + static_cast<int>(a),
                                                             columns.first + static_cast<int>(b)});
                    }
                    sum += rows.weights[a] * along;
                }
                result.push_back(scale * sum);
            }
        }
    }
    return result;
}

}  // namespace btfield::detail
