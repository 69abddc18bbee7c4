#pragma once

// From Gaussian eigenplanes to a picture as theory 3 and 13 write it, in float64.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace btfield::reference {

/// q(x): linear between knots at −3.5 + 7 k/(n − 1), constant beyond; the weights of the two knots around x.
inline double mapped(const std::vector<double>& q, double x) {
    const double step = 7.0 / static_cast<double>(q.size() - 1);
    if (x <= -3.5) return q.front();
    if (x >= 3.5) return q.back();
    const auto k = std::min(static_cast<std::size_t>(std::floor((x + 3.5) / step)), q.size() - 2);
    const double weight = (x - (-3.5 + static_cast<double>(k) * step)) / step;
    return (1.0 - weight) * q[k] + weight * q[k + 1];
}

/// y_i = μ_i + Σ_j T_ji m_j of one pixel; t is r × d row-major.
inline std::vector<double> restored(const std::vector<double>& t, const std::vector<double>& mean,
                                    const std::vector<double>& m) {
    std::vector<double> y = mean;
    for (std::size_t j = 0; j < m.size(); ++j)
        for (std::size_t i = 0; i < y.size(); ++i) y[i] += t[j * y.size() + i] * m[j];
    return y;
}

}  // namespace btfield::reference
