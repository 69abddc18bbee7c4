#pragma once

// MEMD as theory 15.2 has it: the plain greedy loop.

#include <cmath>
#include <cstddef>
#include <vector>

#include "btfield/image.hpp"
#include "btfield/memd.hpp"

namespace btfield::reference {

/// Units 0…255 in float32; below 2⁻³⁹ is 0.
inline float colour_value(float v, double white) {
    const auto scale = static_cast<float>(255.0 / white);
    const float y = v * scale;
    return std::abs(y) < 0x1p-39F ? 0.0F : y;
}

/// Float32, rounded once after every operation, planes in order; squared for l2.
inline float distance(const float* a, const float* b, int planes, Metric metric) {
    float sum = 0.0F;
    for (int i = 0; i < planes; ++i) {
        const float difference = std::abs(a[i] - b[i]);
        if (metric == Metric::max) {
            sum = difference > sum ? difference : sum;
        } else if (metric == Metric::l1) {
            sum += difference;
        } else {
            const float square = difference * difference;
            sum += square;
        }
    }
    return sum;
}

inline std::vector<float> colours(const Image& image, double white) {
    std::vector<float> values;
    for (std::size_t r = 0; r < area(image.size()); ++r)
        for (int p = 0; p < image.planes(); ++p) values.push_back(colour_value(image.plane(p)[r], white));
    return values;
}

inline Memd memd(const Image& a, const Image& b, const MemdOptions& options = {}) {
    const std::vector<float> ya = colours(a, options.white[0]), yb = colours(b, options.white[1]);
    const auto d = static_cast<std::size_t>(a.planes());
    std::vector<bool> taken(area(b.size()), false);
    Memd result;
    result.pixels = {area(a.size()), area(b.size())};
    result.local_errors.assign(area(a.size()), -1.0F);
    double sum = 0.0;
    std::size_t scanned = 0;
    for (; scanned < area(a.size()) && scanned < area(b.size()); ++scanned) {
        float least = 0.0F;
        std::size_t nearest = taken.size();
        for (std::size_t r = 0; r < taken.size(); ++r) {
            if (taken[r]) continue;
            const float here = distance(&ya[d * scanned], &yb[d * r], a.planes(), options.metric);
            if (nearest == taken.size() || here < least) {
                least = here;
                nearest = r;
            }
        }
        taken[nearest] = true;
        const double error =
            options.metric == Metric::l2 ? std::sqrt(static_cast<double>(least)) : static_cast<double>(least);
        result.local_errors[scanned] = static_cast<float>(error);
        sum += error;
    }
    result.memd = sum / static_cast<double>(scanned);
    return result;
}

}  // namespace btfield::reference
