#include "host/btf/btf_tables.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/half.hpp"

namespace btfield::detail {

using Eigen::Index;

float kept_mean(double mean) {
    constexpr double largest = 65504.0;
    return float_of_half(half_of_float(static_cast<float>(std::clamp(mean, 0.0, largest))));
}

bool height_varies(const Image& height) {
    const auto [low, high] = std::ranges::minmax_element(height.values());
    return *high > *low;
}

void fill_tables(BtfModel& model, const BtfSet& set, const std::vector<std::vector<int>>& lights,
                 const std::vector<JointView>& views, const JointPlanes& planes) {
    const Index m = planes.planes.cols();
    BtfTables& tables = model.tables;
    Eigen::RowVectorXd largest = Eigen::RowVectorXd::Constant(m, 1e-30);
    double offset = 1e-30;
    for (std::size_t v = 0; v < views.size(); ++v) {
        largest = largest.cwiseMax(planes.weights[v].cwiseAbs().colwise().maxCoeff());
        for (const double value : planes.offsets[v]) offset = std::max(offset, std::abs(value));
    }
    tables.offset_unit = offset / 32767.0;
    for (Index k = 0; k < m; ++k) tables.weight_units.push_back(largest[k] / 127.0);
    bool moved = false;
    for (std::size_t v = 0; v < views.size(); ++v) {
        const int view = views[v].index;
        for (const int light : lights[static_cast<std::size_t>(view)]) {
            model.pairs.push_back({view, light});
            const BtfDirection from = set.light(view, light);
            model.true_lights.push_back(from);
            moved |= !(from == set.lights()[static_cast<std::size_t>(light)]);
        }
        for (Index row = 0; row < planes.weights[v].rows(); ++row) {
            const auto at = static_cast<std::size_t>(row);
            tables.mean.push_back(kept_mean(views[v].reduced.mean[at]));
            tables.offsets.push_back(
                static_cast<std::int16_t>(std::lround(planes.offsets[v][at] / tables.offset_unit)));
            for (Index k = 0; k < m; ++k)
                tables.weights.push_back(static_cast<std::int8_t>(std::lround(
                    planes.weights[v](row, k) / tables.weight_units[static_cast<std::size_t>(k)])));
        }
    }
    if (!moved) model.true_lights.clear();
}

}  // namespace btfield::detail
