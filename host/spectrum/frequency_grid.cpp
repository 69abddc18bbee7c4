#include "host/spectrum/frequency_grid.hpp"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace btfield::detail {
namespace {

using std::size_t;
using std::numbers::pi;

struct Axis {
    std::vector<double> node, weight;  ///< n = 0 … N/2 only: 0 <= ω <= π
};

/// Nodes of half an axis, and the weights of single nodes, whose sum over the whole axis is 1.
Axis half_axis(int uniform, int per_level, int levels) {
    const int nodes = uniform + per_level * levels;
    Axis axis;
    double at = 0.0;
    for (int n = 0; n <= nodes / 2; ++n) {
        const double goal = 2.0 * pi * n;  // N t
        double slope = 0.0;
        if (2 * n == nodes) at = pi;
        double low = 0.0, high = pi;
        // Newton's method, kept inside a bracket: t is concave on (0, π), so it converges from the left.
        for (int step = 0; step < 200; ++step) {
            double value = -goal;
            slope = 0.0;
            double sharpness = 1.0;
            const double sine = std::sin(0.5 * at), cosine = std::cos(0.5 * at);
            for (int k = 0; k <= levels; ++k, sharpness *= 4.0) {
                const double share = k == 0 ? uniform : per_level;
                value += share * 2.0 * std::atan2(sharpness * sine, cosine);
                slope += share * sharpness / (cosine * cosine + sharpness * sharpness * sine * sine);
            }
            if (n == 0 || 2 * n == nodes) break;
            (value < 0.0 ? low : high) = at;
            double next = at - value / slope;
            if (!(next > low && next < high)) next = 0.5 * (low + high);
            const double moved = std::abs(next - at);
            at = next;
            if (moved <= 4e-16 * at) break;
        }
        axis.node.push_back(at);
        axis.weight.push_back(1.0 / slope);
    }
    // What the rule gives for the mean of 1: exact up to its own error.
    double sum = 0.0;
    for (size_t n = 0; n < axis.node.size(); ++n)
        sum += (n == 0 || n + 1 == axis.node.size() ? 1.0 : 2.0) * axis.weight[n];
    for (double& weight : axis.weight) weight /= sum;
    return axis;
}

}  // namespace

FrequencyGrid clustered_grid(const GridDensity& density) {
    FrequencyGrid grid;
    const Axis rows = half_axis(density.uniform, density.per_level, density.row_levels);
    for (size_t m = 0; m < rows.node.size(); ++m) {
        const bool own_mirror = m == 0 || m + 1 == rows.node.size();
        grid.row.push_back(rows.node[m]);
        grid.row_weight.push_back((own_mirror ? 1.0 : 2.0) * rows.weight[m]);
    }
    const Axis columns = half_axis(density.uniform, density.per_level, density.column_levels);
    for (size_t n = 0; n < columns.node.size(); ++n) {
        grid.column.push_back(columns.node[n]);
        grid.column_weight.push_back(columns.weight[n]);
    }
    for (size_t n = columns.node.size() - 2; n > 0; --n) {
        grid.column.push_back(-columns.node[n]);
        grid.column_weight.push_back(columns.weight[n]);
    }
    return grid;
}

}  // namespace btfield::detail
