#pragma once

#include <cmath>
#include <span>

namespace btfield::detail {

struct PlaneMoments {
    double mean = 0.0, deviation = 0.0;  ///< deviation 0: as good as constant, and what follows is not set
    double skewness = 0.0, kurtosis = 3.0;
};

template <typename Value>
[[nodiscard]] PlaneMoments plane_moments(std::span<const Value> values) {
    PlaneMoments of;
    const auto count = static_cast<double>(values.size());
    for (const Value value : values) of.mean += static_cast<double>(value);
    of.mean /= count;
    double second = 0.0, third = 0.0, fourth = 0.0;
    for (const Value value : values) {
        const double d = static_cast<double>(value) - of.mean, dd = d * d;
        second += dd;
        third += dd * d;
        fourth += dd * dd;
    }
    second /= count;
    if (!(second > 1e-12)) return of;
    of.deviation = std::sqrt(second);
    of.skewness = third / count / (second * of.deviation);
    of.kurtosis = fourth / count / (second * second);
    return of;
}

}  // namespace btfield::detail
