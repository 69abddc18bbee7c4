#pragma once

// Photometric stereo of one pixel as theory 19.3 and 19.4 write it, in float64.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

namespace btfield::reference {

using Vector3 = std::array<double, 3>;
using Unknowns = std::array<double, 5>;  ///< b, ambient, strength of the lobe

inline double dot(const Vector3& a, const Vector3& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Vector3 unit(const Vector3& a) {
    const double length = std::sqrt(dot(a, a));
    return {a[0] / length, a[1] / length, a[2] / length};
}

/// A x = y of n unknowns, A symmetric and positive.
template <std::size_t N>
std::array<double, N> solved(std::array<std::array<double, N>, N> a, std::array<double, N> y) {
    for (std::size_t i = 0; i < N; ++i)
        for (std::size_t k = i + 1; k < N; ++k) {
            const double factor = a[k][i] / a[i][i];
            for (std::size_t j = i; j < N; ++j) a[k][j] -= factor * a[i][j];
            y[k] -= factor * y[i];
        }
    for (std::size_t i = N; i-- > 0;) {
        for (std::size_t j = i + 1; j < N; ++j) y[i] -= a[i][j] * y[j];
        y[i] /= a[i][i];
    }
    return y;
}

/// Of this rank, from 0; to its first 4 bits behind the leading one where it is rounded.
inline double order_statistic(std::vector<double> values, std::size_t rank, bool rounded) {
    std::ranges::sort(values);
    const auto value = static_cast<float>(values[rank]);
    if (!rounded) return static_cast<double>(value);
    return static_cast<double>(std::bit_cast<float>(std::bit_cast<std::uint32_t>(value) & 0xfff80000U));
}

/// One pixel, and what its rule takes of it.
struct PixelStereo {
    std::vector<double> values;
    std::vector<Vector3> lights;
    double roughness = 0.5;
    double gate = 0.0, floor = 0.0;

    void set_gate() {
        const std::size_t last = values.size() - 1;
        gate = 0.15 * order_statistic(values, 8 * last / 10, true);
        floor = std::max(0.01 * order_statistic(values, 9 * last / 10, true), 1e-30);
    }
    [[nodiscard]] bool counts(std::size_t k) const { return values[k] >= gate; }
    [[nodiscard]] double shade(const Unknowns& x, std::size_t k) const {
        return dot({x[0], x[1], x[2]}, lights[k]);
    }
    /// D f of the lobe.
    [[nodiscard]] double lobe(const Unknowns& x, std::size_t k) const {
        const Vector3 n = unit({x[0], x[1], x[2]});
        const Vector3 h = unit({lights[k][0], lights[k][1], lights[k][2] + 1.0});
        const double cosine = dot(n, h), alpha = roughness * roughness;
        const double root = alpha / (cosine * cosine * (alpha - 1.0) + 1.0);
        return cosine > 0.0 ? root * root * std::clamp(10.0 * dot(n, lights[k]), 0.0, 1.0) : 0.0;
    }
    [[nodiscard]] double model(const Unknowns& x, std::size_t k) const {
        const double gloss = x[4] > 0.0 ? x[4] * lobe(x, k) : 0.0;
        return std::max(shade(x, k), 0.0) + x[3] + gloss;
    }
    [[nodiscard]] double scale(const Unknowns& x) const {
        std::vector<double> sizes;
        for (std::size_t k = 0; k < values.size(); ++k)
            if (counts(k)) sizes.push_back(std::abs(values[k] - model(x, k)));
        if (sizes.empty()) return floor;
        std::ranges::sort(sizes);
        // The largest step of an eighth octave, from the floor's own octave on, that the median reaches.
        const double octave = std::exp2(std::floor(std::log2(floor * 0.5)));
        double step = octave;
        for (int i = 1; i < 64; ++i) {
            const double next = octave * std::exp2(i / 8) * (1.0 + (i % 8) / 8.0);
            if (next <= sizes[sizes.size() / 2]) step = next;
        }
        return std::max(1.4826 * 1.0625 * step, floor);
    }

    /// Least squares over lights of these weights.
    [[nodiscard]] Unknowns weighted(const std::vector<double>& weights) const {
        std::array<std::array<double, 3>, 3> a{};
        Vector3 y{};
        for (std::size_t k = 0; k < values.size(); ++k)
            for (std::size_t i = 0; i < 3; ++i) {
                for (std::size_t j = 0; j < 3; ++j) a[i][j] += weights[k] * lights[k][i] * lights[k][j];
                y[i] += weights[k] * lights[k][i] * values[k];
            }
        const Vector3 b = solved(a, y);
        return {b[0], b[1], b[2], 0.0, 0.0};
    }
    [[nodiscard]] Unknowns least_squares() const { return weighted(std::vector<double>(values.size(), 1.0)); }
    [[nodiscard]] Unknowns ranks(double low, double high) const {
        const auto last = static_cast<double>(values.size() - 1);
        const double from = order_statistic(values, static_cast<std::size_t>(std::ceil(low * last)), false),
                     to = order_statistic(values, static_cast<std::size_t>(std::floor(high * last)), false);
        std::vector<double> weights;
        for (const double value : values)
            weights.push_back(static_cast<float>(value) >= static_cast<float>(from) &&
                                      static_cast<float>(value) <= static_cast<float>(to)
                                  ? 1.0
                                  : 0.0);
        return weighted(weights);
    }

    /// Reweighted least squares; with ambient light or without.
    [[nodiscard]] Unknowns reweighted(Unknowns x, bool ambient, int steps,
                                      const std::function<double(double)>& weight) const {
        for (int t = 0; t < steps; ++t) {
            const double s = scale(x);
            std::vector<double> weights;
            double total = 0.0;
            for (std::size_t k = 0; k < values.size(); ++k) {
                const double u = std::abs(values[k] - model(x, k)) / s;
                weights.push_back(counts(k) && shade(x, k) > 0.0 ? weight(u) : 0.0);
                total += weights.back();
            }
            if (!(total > 0.0)) return x;
            Unknowns next = weighted(weights);
            if (ambient) {
                std::array<std::array<double, 4>, 4> a{};
                std::array<double, 4> y{};
                for (std::size_t k = 0; k < values.size(); ++k) {
                    const std::array<double, 4> row{lights[k][0], lights[k][1], lights[k][2], 1.0};
                    for (std::size_t i = 0; i < 4; ++i) {
                        for (std::size_t j = 0; j < 4; ++j) a[i][j] += weights[k] * row[i] * row[j];
                        y[i] += weights[k] * row[i] * values[k];
                    }
                }
                a[3][3] += 0.01 * total;
                const std::array<double, 4> with = solved(a, y);
                if (with[3] >= 0.0) next = {with[0], with[1], with[2], with[3], 0.0};
            }
            x = next;
        }
        return x;
    }
};

inline double huber_weight(double u) {
    return std::min(1.0, 1.345 / std::max(u, 1e-30));
}
inline double cauchy_weight(double u) {
    return 1.0 / (1.0 + u * u);
}
inline double geman_mcclure_weight(double u) {
    return 1.0 / ((1.0 + u * u) * (1.0 + u * u));
}

}  // namespace btfield::reference
