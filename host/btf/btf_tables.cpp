#include "host/btf/btf_tables.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/base/half.hpp"
#include "host/base/parallel.hpp"
#include "host/btf/direction_table.hpp"
#include "host/btf/kept_directions.hpp"

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

namespace {

/// Pairs and true lights of the model, and means of their pictures; m and U, [pair][colour: m, then U].
RowMajorMatrix rows_of_pairs(BtfModel& model, const BtfSet& set, const std::vector<std::vector<int>>& lights,
                             const std::vector<JointView>& views, const JointPlanes& planes,
                             std::vector<double>& means) {
    const Index m = planes.planes.cols(), colours = model.colours, values = 1 + m;
    bool moved = false;
    std::size_t count = 0;
    for (const JointView& view : views) count += lights[static_cast<std::size_t>(view.index)].size();
    RowMajorMatrix rows(static_cast<Index>(count), colours * values);
    Index at = 0;
    for (std::size_t v = 0; v < views.size(); ++v) {
        const int view = views[v].index;
        Index row = 0;
        for (const int light : lights[static_cast<std::size_t>(view)]) {
            model.pairs.push_back({view, light});
            const BtfDirection from = set.light(view, light);
            model.true_lights.push_back(from);
            moved |= !(from == set.lights()[static_cast<std::size_t>(light)]);
            for (Index c = 0; c < colours; ++c, ++row) {
                const auto of_view = static_cast<std::size_t>(row);
                means.push_back(views[v].reduced.mean[of_view]);
                rows(at, c * values) = planes.offsets[v][of_view];
                rows.block(at, c * values + 1, 1, m) = planes.weights[v].row(row);
            }
            ++at;
        }
    }
    if (!moved) model.true_lights.clear();
    return rows;
}

/// Σ U² of each pair: cov T = 1.
std::vector<double> variances(const RowMajorMatrix& rows, Index colours) {
    const Index values = rows.cols() / colours;
    std::vector<double> result(static_cast<std::size_t>(rows.rows()), 0.0);
    for (Index pair = 0; pair < rows.rows(); ++pair)
        for (Index c = 0; c < colours; ++c)
            result[static_cast<std::size_t>(pair)] +=
                rows.block(pair, c * values + 1, 1, values - 1).squaredNorm();
    return result;
}

/// μ for which planes seen through the relief have the picture's mean, whatever they leave unexplained.
void fill_means(BtfModel& model, const std::vector<JointView>& views, const JointPlanes& planes,
                const std::vector<double>& means) {
    model.tables.mean.assign(means.size(), 0.0F);
    const DirectionTable table(model);
    const std::vector<DirectionPair> pairs = direction_pairs(model);
    std::vector<std::size_t> place(model.views.size());
    for (std::size_t v = 0; v < views.size(); ++v) place[static_cast<std::size_t>(views[v].index)] = v;
    const auto colours = static_cast<std::size_t>(model.colours);
    for_each_block(static_cast<int>(pairs.size()), [&](int block) {
        const auto pair = static_cast<std::size_t>(block);
        const std::size_t v = place[static_cast<std::size_t>(model.pairs[pair].view)];
        const std::vector<double> squares =
            table.mean_squares(pairs[pair], planes.seen_mean[v], planes.seen_moments[v]);
        for (std::size_t c = 0; c < colours; ++c) {
            const std::size_t row = pair * colours + c;
            model.tables.mean[row] = kept_mean(squares[c] > 0.0 ? means[row] / squares[c] : 0.0);
        }
    });
}

}  // namespace

void fill_tables(BtfModel& model, const BtfSet& set, const std::vector<std::vector<int>>& lights,
                 const std::vector<JointView>& views, const JointPlanes& planes, double bound,
                 const std::function<void(double)>& progress) {
    std::vector<double> means;
    const RowMajorMatrix rows = rows_of_pairs(model, set, lights, views, planes, means);
    const Index colours = model.colours, values = rows.cols() / colours, m = values - 1;
    KeptDirections kept =
        keep_directions(direction_pairs(model), rows, variances(rows, colours), bound, progress);
    model.table_error = kept.error;
    BtfTables& tables = model.tables;
    tables.kept = std::move(kept.pairs);
    Eigen::RowVectorXd largest = Eigen::RowVectorXd::Constant(values, 1e-30);
    for (const std::uint32_t pair : tables.kept)
        for (Index c = 0; c < colours; ++c)
            largest = largest.cwiseMax(rows.block(pair, c * values, 1, values).cwiseAbs());
    tables.offset_unit = largest[0] / 32767.0;
    for (Index k = 0; k < m; ++k) tables.weight_units.push_back(largest[k + 1] / 127.0);
    for (const std::uint32_t pair : tables.kept)
        for (Index c = 0; c < colours; ++c) {
            tables.offsets.push_back(
                static_cast<std::int16_t>(std::lround(rows(pair, c * values) / tables.offset_unit)));
            for (Index k = 0; k < m; ++k)
                tables.weights.push_back(static_cast<std::int8_t>(std::lround(
                    rows(pair, c * values + 1 + k) / tables.weight_units[static_cast<std::size_t>(k)])));
        }
    fill_means(model, views, planes, means);
}

}  // namespace btfield::detail
