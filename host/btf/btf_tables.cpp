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

void round_means(std::vector<float>& means) {
    // Below the least, pictures a thousand times darker than the brightest would lose their digits.
    constexpr float least = 0x1p-7F, largest = 65504.0F;
    const float brightest = means.empty() ? 0.0F : std::ranges::max(means);
    if (brightest < least || brightest > largest) return;
    for (float& mean : means) mean = float_of_half(half_of_float(mean));
}

bool height_varies(const Image& height) {
    const auto [low, high] = std::ranges::minmax_element(height.values());
    return *high > *low;
}

namespace {

struct PairRows {
    RowMajorMatrix weights;        ///< U, [pair][colour][plane]
    std::vector<double> contrast;  ///< [pair][colour]: standard deviation of I / μ
};

/// Pairs of the model with true lights and means.
PairRows rows_of_pairs(BtfModel& model, const BtfSet& set, const std::vector<std::vector<int>>& lights,
                       const std::vector<JointView>& views, const JointPlanes& planes) {
    const Index m = planes.planes.cols(), colours = model.colours;
    bool moved = false;
    std::size_t count = 0;
    for (const JointView& view : views) count += lights[static_cast<std::size_t>(view.index)].size();
    PairRows rows{RowMajorMatrix(static_cast<Index>(count), colours * m), {}};
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
                model.tables.mean.push_back(
                    static_cast<float>(std::max(views[v].reduced.mean[of_view], 0.0)));
                rows.contrast.push_back(views[v].reduced.contrast[of_view]);
                rows.weights.block(at, c * m, 1, m) = planes.weights[v].row(row);
            }
            ++at;
        }
    }
    round_means(model.tables.mean);
    if (!moved) model.true_lights.clear();
    return rows;
}

/// Σ U² of each pair: cov T = 1.
std::vector<double> variances(const RowMajorMatrix& weights) {
    const Eigen::VectorXd sums = weights.rowwise().squaredNorm();
    return {sums.begin(), sums.end()};
}

void fill_weights(BtfTables& tables, const RowMajorMatrix& weights, Index colours) {
    const Index m = weights.cols() / colours;
    Eigen::RowVectorXd largest = Eigen::RowVectorXd::Constant(m, 1e-30);
    for (const std::uint32_t pair : tables.kept)
        for (Index c = 0; c < colours; ++c)
            largest = largest.cwiseMax(weights.block(pair, c * m, 1, m).cwiseAbs());
    for (Index k = 0; k < m; ++k) tables.weight_units.push_back(largest[k] / 127.0);
    for (const std::uint32_t pair : tables.kept)
        for (Index i = 0; i < weights.cols(); ++i)
            tables.weights.push_back(static_cast<std::int8_t>(
                std::lround(weights(pair, i) / tables.weight_units[static_cast<std::size_t>(i % m)])));
}

/// Beside U as the tables tell it.
void fill_contrasts(BtfModel& model, const std::vector<double>& contrast) {
    model.tables.contrast.assign(contrast.size(), 0);
    const DirectionTable table(model);
    const std::vector<DirectionPair> pairs = direction_pairs(model);
    const auto colours = static_cast<std::size_t>(model.colours);
    for_each_block(static_cast<int>(pairs.size()), [&](int block) {
        const auto pair = static_cast<std::size_t>(block);
        const std::vector<double> squares = table.squared_lengths(pairs[pair]);
        for (std::size_t c = 0; c < colours; ++c) {
            const std::size_t row = pair * colours + c;
            model.tables.contrast[row] = kept_contrast(contrast[row], std::sqrt(squares[c]));
        }
    });
}

}  // namespace

void fill_tables(BtfModel& model, const BtfSet& set, const std::vector<std::vector<int>>& lights,
                 const std::vector<JointView>& views, const JointPlanes& planes, double bound,
                 const std::function<void(double)>& progress) {
    const PairRows rows = rows_of_pairs(model, set, lights, views, planes);
    KeptDirections kept =
        keep_directions(direction_pairs(model), rows.weights, variances(rows.weights), bound, progress);
    model.table_error = kept.error;
    model.tables.kept = std::move(kept.pairs);
    fill_weights(model.tables, rows.weights, model.colours);
    fill_contrasts(model, rows.contrast);
}

}  // namespace btfield::detail
