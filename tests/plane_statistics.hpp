#pragma once

// Mean and standard deviation of values.

#include <cmath>
#include <span>

namespace btfield::test {

struct PlaneStatistics {
    double mean = 0.0, deviation = 0.0;
};
inline PlaneStatistics statistics_of(std::span<const float> values) {
    double sum = 0.0, squares = 0.0;
    for (const float v : values) sum += static_cast<double>(v);
    const double mean = sum / static_cast<double>(values.size());
    for (const float v : values) squares += (static_cast<double>(v) - mean) * (static_cast<double>(v) - mean);
    return {mean, std::sqrt(squares / static_cast<double>(values.size()))};
}

}  // namespace btfield::test
