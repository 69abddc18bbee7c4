#include "host/btf/matched_tone.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace btfield::detail {
namespace {

constexpr std::size_t tone_groups = 4096;
constexpr double largest_exponent = 16.0, least_contrast = 1e-5, same_exponent = 1e-4;
constexpr int most_steps = 40;

struct PowerMoments {
    double mean = 0.0, deviation = 0.0;
    [[nodiscard]] double contrast() const { return mean > 0.0 ? deviation / mean : 0.0; }
};

/// Of values raised to a power, in units of the largest.
PowerMoments moments_of_power(const std::vector<double>& values, double exponent) {
    const double largest = values.back();
    double sum = 0.0, squares = 0.0;
    for (const double value : values) {
        const double raised = std::pow(value / largest, exponent);
        sum += raised;
        squares += raised * raised;
    }
    const auto count = static_cast<double>(values.size());
    const double mean = sum / count;
    return {mean, std::sqrt(std::max(squares / count - mean * mean, 0.0))};
}

}  // namespace

TonedPlane::TonedPlane(std::span<const float> values) {
    std::vector<float> sorted(values.begin(), values.end());
    std::ranges::sort(sorted);
    const std::size_t count = std::min(tone_groups, sorted.size());
    double all = 0.0, squares = 0.0;
    for (std::size_t g = 0; g < count; ++g) {
        const std::size_t first = g * sorted.size() / count, end = (g + 1) * sorted.size() / count;
        double sum = 0.0;
        for (std::size_t i = first; i < end; ++i) {
            const auto value = static_cast<double>(std::max(sorted[i], 0.0F));
            sum += value;
            squares += value * value;
        }
        all += sum;
        quantiles_.push_back(sum / static_cast<double>(end - first));
    }
    mean_ = all / static_cast<double>(sorted.size());
    deviation_ = std::sqrt(std::max(squares / static_cast<double>(sorted.size()) - mean_ * mean_, 0.0));
}

Tone TonedPlane::tone(double mean, double deviation) const {
    if (!(mean_ > 0.0) || !(mean > 0.0)) return {0.0, 1.0};
    const double wanted = deviation / mean, found = deviation_ / mean_;
    if (!(found > least_contrast)) return {mean / mean_, 1.0};
    if (!(wanted > least_contrast)) return {mean, 0.0};
    // Contrasts of powers grow with the exponent, nearly in proportion to it.
    double low = 1.0 / largest_exponent, high = largest_exponent;
    double exponent = std::clamp(wanted / found, low, high);
    for (int step = 0; step < most_steps; ++step) {
        const double contrast = moments_of_power(quantiles_, exponent).contrast();
        (contrast < wanted ? low : high) = exponent;
        const double next = exponent * wanted / std::max(contrast, least_contrast);
        if (std::abs(next - exponent) < same_exponent * exponent || high - low < same_exponent * low) break;
        exponent = next > low && next < high ? next : std::sqrt(low * high);
    }
    const double largest = quantiles_.back();
    const double raised = moments_of_power(quantiles_, exponent).mean;
    return {mean / raised * std::pow(largest, -exponent), exponent};
}

void tone_plane(std::span<float> values, const Tone& tone) {
    const auto factor = static_cast<float>(tone.factor), exponent = static_cast<float>(tone.exponent);
    if (tone.exponent == 0.0) {
        std::ranges::fill(values, factor);
    } else if (tone.exponent == 1.0) {
        for (float& value : values) value = factor * std::max(value, 0.0F);
    } else {
        for (float& value : values) value = factor * std::pow(std::max(value, 0.0F), exponent);
    }
}

}  // namespace btfield::detail
