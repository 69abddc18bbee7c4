#include "host/btf/plane_tone.hpp"

#include <algorithm>
#include <cmath>

namespace btfield::detail {
namespace {

constexpr std::size_t most_groups = 512;
/// Of deviations: values that are as good as constant.
constexpr double least_deviation = 1e-6;
/// Depths that are looked at, and how closely.
constexpr double least_depth = 1e-5, most_depth = 100.0;
constexpr int halvings = 40;
/// Of the normal distribution, as far as it has values.
constexpr double farthest = 5.0;
constexpr int normal_groups = 201;

}  // namespace

PlaneDistribution::PlaneDistribution() {
    double sum = 0.0, squares = 0.0;
    for (int i = 0; i < normal_groups; ++i) {
        const double value = farthest * (2.0 * i / (normal_groups - 1) - 1.0);
        groups_.push_back({value, std::exp(-0.5 * value * value)});
        sum += groups_.back().share;
        squares += groups_.back().share * value * value;
    }
    const double scale = std::sqrt(sum / squares);
    for (Group& group : groups_) {
        group.value *= scale;
        group.share /= sum;
    }
}

PlaneDistribution::PlaneDistribution(std::span<const float> values) {
    const auto count = static_cast<double>(values.size());
    double sum = 0.0, squares = 0.0;
    for (const float value : values) sum += static_cast<double>(value);
    mean_ = sum / count;
    float low = values.front(), high = low;
    for (const float value : values) {
        const double off = static_cast<double>(value) - mean_;
        squares += off * off;
        low = std::min(low, value);
        high = std::max(high, value);
    }
    deviation_ = std::sqrt(squares / count);
    if (!(deviation_ > least_deviation)) return;
    const double scale =
        static_cast<double>(most_groups) / (static_cast<double>(high) - static_cast<double>(low));
    std::vector<double> sums(most_groups), counts(most_groups);
    for (const float value : values) {
        const auto at =
            static_cast<std::size_t>(scale * (static_cast<double>(value) - static_cast<double>(low)));
        const std::size_t group = std::min(at, most_groups - 1);
        sums[group] += static_cast<double>(value);
        counts[group] += 1.0;
    }
    for (std::size_t i = 0; i < most_groups; ++i)
        if (counts[i] > 0.0)
            groups_.push_back({(sums[i] / counts[i] - mean_) / deviation_, counts[i] / count});
}

PlaneDistribution::Powers PlaneDistribution::powers(double y) const {
    Powers result{0.0, 0.0};
    for (const Group& group : groups_) {
        const double z = std::max(0.0, 1.0 + y * group.value), square = z * z;
        result.second += group.share * square;
        result.fourth += group.share * square * square;
    }
    return result;
}

PlaneTone PlaneDistribution::tone(double contrast, double mean, double deviation) const {
    if (groups_.empty() || !(deviation > least_deviation) || !(contrast > 0.0)) return {};
    // E z⁴ / (E z²)² is 1 + contrast²; it grows with the depth.
    const double asked = 1.0 + contrast * contrast;
    double below = std::log(least_depth), above = std::log(most_depth);
    for (int i = 0; i < halvings; ++i) {
        const double middle = 0.5 * (below + above);
        const Powers of = powers(std::exp(middle));
        (of.fourth < asked * of.second * of.second ? below : above) = middle;
    }
    const double y = std::exp(0.5 * (below + above)), root = 1.0 / std::sqrt(powers(y).second);
    return {root * (1.0 - y * mean / deviation), root * y / deviation};
}

}  // namespace btfield::detail
