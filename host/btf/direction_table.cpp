#include "host/btf/direction_table.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "host/btf/spread_pixels.hpp"

namespace btfield::detail {
namespace {

/// Pixels that tell the moments of sums of planes.
constexpr std::size_t sampled_pixels = 4096;
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

MeasuredDirections::MeasuredDirections(const BtfMeasured& model)
    : white_(model.white), pairs_(direction_pairs(model)), points_(pairs_) {}

std::vector<double> MeasuredDirections::light(const std::vector<PairWeight>& of, const BtfDirection& light,
                                              const std::vector<float>& table) const {
    const std::size_t values = table.size() / pairs_.size();
    std::vector<double> result(values);
    for (const PairWeight& each : of) {
        const double upward = std::cos(pairs_[each.pair].light.theta);
        for (std::size_t i = 0; i < values; ++i) {
            // A black picture is nearly so.
            const double value = std::max(static_cast<double>(table[each.pair * values + i]), 1e-7 * white_);
            result[i] += each.weight * std::log(value / upward);
        }
    }
    const double upward = std::cos(std::min(light.theta, points_.steepest_light()));
    for (double& value : result) value = std::exp(value) * upward;
    return result;
}

SampledPlanes::SampledPlanes(const Image& surface) : planes_(static_cast<std::size_t>(surface.planes() - 1)) {
    for (const std::size_t pixel : spread_pixels(area(surface.size()), sampled_pixels))
        for (std::size_t k = 0; k < planes_; ++k)
            values_.push_back(surface.plane(static_cast<int>(k) + 1)[pixel]);
}

PlaneMoments SampledPlanes::moments(std::span<const double> weights) const {
    std::vector<double> sums(values_.size() / planes_);
    for (std::size_t p = 0; p < sums.size(); ++p)
        for (std::size_t k = 0; k < planes_; ++k)
            sums[p] += weights[k] * static_cast<double>(values_[p * planes_ + k]);
    return plane_moments(std::span<const double>(sums));
}

PlaneTone plane_tone(const PlaneMoments& moments, double contrast) {
    if (!(moments.deviation > 0.0)) return {};
    const double y = depth_of_contrast(contrast, moments.skewness, moments.kurtosis);
    const double root = 1.0 / std::sqrt(1.0 + y * y), slope = root * y / moments.deviation;
    return {root - slope * moments.mean, slope};
}

DirectionTable::DirectionTable(const BtfModel& model, const Image* surface)
    : model_(&model), measured_(model), kept_(kept_pairs(model)) {
    if (surface != nullptr) planes_.emplace(*surface);
}

double depth_of_contrast(double contrast, double skewness, double kurtosis) {
    if (!(contrast > 0.0)) return 0.0;
    // E z⁴ / (E z²)², which is 1 + contrast².
    const double asked = 1.0 + contrast * contrast;
    const auto reached = [&](double y) {
        const double yy = y * y, second = 1.0 + yy;
        return (1.0 + 6.0 * yy + 4.0 * skewness * yy * y + kurtosis * yy * yy) / (second * second);
    };
    // Of skewed planes it may fall again: the first y that has it, in steps of a few percent.
    constexpr double step = 1.05, least = 1e-4, most = 20.0;
    double below = 0.0, best = 0.0, largest = 1.0;
    for (double y = least; y < most; y *= step) {
        const double found = reached(y);
        if (found >= asked) {
            double above = y;
            for (int i = 0; i < 40; ++i) {
                const double middle = 0.5 * (below + above);
                (reached(middle) < asked ? below : above) = middle;
            }
            return 0.5 * (below + above);
        }
        if (found > largest) {
            largest = found;
            best = y;
        }
        below = y;
    }
    return best;
}

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
        const PlaneTone tone = plane_tone(planes_ ? planes_->moments(own) : PlaneMoments{.deviation = length},
                                          result.contrast[c]);
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
