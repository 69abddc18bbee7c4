#include "host/btf/direction_table.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace btfield::detail {
namespace {

/// Contrasts from a quarter of 2 |U| to four times it.
const double contrast_unit = std::log(4.0) / 127.0;

std::vector<DirectionPair> kept_pairs(const BtfModel& model) {
    std::vector<DirectionPair> kept;
    const std::vector<DirectionPair> all = direction_pairs(model);
    for (const std::uint32_t pair : model.tables.kept) kept.push_back(all[pair]);
    return kept;
}

}  // namespace

BtfDirection light_of(const BtfMeasured& model, std::size_t pair) {
    if (!model.true_lights.empty()) return model.true_lights[pair];
    return model.lights[static_cast<std::size_t>(model.pairs[pair].light)];
}

std::vector<DirectionPair> direction_pairs(const BtfMeasured& model) {
    std::vector<DirectionPair> pairs(model.pairs.size());
    for (std::size_t i = 0; i < pairs.size(); ++i)
        pairs[i] = {model.views[static_cast<std::size_t>(model.pairs[i].view)], light_of(model, i)};
    return pairs;
}

double steepest_view(const BtfMeasured& model) {
    return DirectionPoints(direction_pairs(model)).steepest_view();
}

MeasuredDirections::MeasuredDirections(const BtfMeasured& model)
    : pairs_(direction_pairs(model)), points_(pairs_) {}

std::vector<double> MeasuredDirections::light(const std::vector<PairWeight>& of, const BtfDirection& light,
                                              const std::vector<float>& table) const {
    const std::size_t values = table.size() / pairs_.size();
    std::vector<double> result(values);
    // A black picture is nearly so.
    const double least = 1e-7 * static_cast<double>(std::ranges::max(table));
    if (!(least > 0.0)) return result;
    for (const PairWeight& each : of) {
        const double upward = std::cos(pairs_[each.pair].light.theta);
        for (std::size_t i = 0; i < values; ++i) {
            const double value = std::max(static_cast<double>(table[each.pair * values + i]), least);
            result[i] += each.weight * std::log(value / upward);
        }
    }
    const double upward = std::cos(std::min(light.theta, points_.steepest_light()));
    for (double& value : result) value = std::exp(value) * upward;
    return result;
}

DirectionTable::DirectionTable(const BtfModel& model, const SeenPlanes* seen)
    : model_(&model), measured_(model), kept_(kept_pairs(model)), seen_(seen) {}

std::int8_t kept_contrast(double contrast, double length) {
    if (!(contrast > 0.0) || !(length > 0.0)) return 0;
    const double units = std::log(contrast / (2.0 * length)) / contrast_unit;
    return static_cast<std::int8_t>(std::lround(std::clamp(units, -127.0, 127.0)));
}

PictureWeights DirectionTable::weights(const BtfDirection& view, const BtfDirection& light) const {
    const BtfTables& tables = model_->tables;
    const auto colours = static_cast<std::size_t>(model_->colours), planes = tables.weight_units.size();
    const std::vector<PairWeight> near = measured_.points().interpolate({view, light});
    PictureWeights result{measured_.light(near, light, tables.mean), std::vector<double>(colours),
                          interpolated({view, light}), std::vector<double>(colours)};
    for (const PairWeight& of : near)
        for (std::size_t c = 0; c < colours; ++c)
            result.contrast[c] += of.weight * contrast_unit * tables.contrast[of.pair * colours + c];
    for (std::size_t c = 0; c < colours; ++c) {
        const std::span<double> own = std::span(result.weights).subspan(c * planes, planes);
        double squares = 0.0;
        for (const double weight : own) squares += weight * weight;
        const double length = std::sqrt(squares);
        result.contrast[c] = 2.0 * length * std::exp(result.contrast[c]);
        const PlaneTone tone = seen_ != nullptr ? seen_->tone(view, own, result.contrast[c])
                                                : normal_.tone(result.contrast[c], 0.0, length);
        result.offsets[c] = tone.offset;
        for (double& weight : own) weight *= tone.slope;
    }
    return result;
}

std::vector<double> DirectionTable::interpolated(const DirectionPair& at) const {
    const BtfTables& tables = model_->tables;
    const std::size_t values = static_cast<std::size_t>(model_->colours) * tables.weight_units.size();
    std::vector<double> weights(values);
    for (const PairWeight& of : kept_.interpolate(at))
        for (std::size_t i = 0; i < values; ++i)
            weights[i] += of.weight * tables.weight_units[i % tables.weight_units.size()] *
                          tables.weights[of.pair * values + i];
    return weights;
}

std::vector<double> DirectionTable::squared_lengths(const DirectionPair& at) const {
    const std::vector<double> weights = interpolated(at);
    std::vector<double> lengths(static_cast<std::size_t>(model_->colours));
    for (std::size_t i = 0; i < weights.size(); ++i)
        lengths[i / model_->tables.weight_units.size()] += weights[i] * weights[i];
    return lengths;
}

}  // namespace btfield::detail
