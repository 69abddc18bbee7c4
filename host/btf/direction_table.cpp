#include "host/btf/direction_table.hpp"

#include <algorithm>
#include <cmath>

namespace btfield::detail {
namespace {

std::vector<DirectionPair> kept_pairs(const BtfModel& model) {
    std::vector<DirectionPair> kept;
    const std::vector<DirectionPair> all = direction_pairs(model);
    for (const std::uint32_t pair : model.tables.kept) kept.push_back(all[pair]);
    return kept;
}

}  // namespace

BtfDirection light_of(const BtfModel& model, std::size_t pair) {
    if (!model.true_lights.empty()) return model.true_lights[pair];
    return model.lights[static_cast<std::size_t>(model.pairs[pair].light)];
}

std::vector<DirectionPair> direction_pairs(const BtfModel& model) {
    std::vector<DirectionPair> pairs(model.pairs.size());
    for (std::size_t i = 0; i < pairs.size(); ++i)
        pairs[i] = {model.views[static_cast<std::size_t>(model.pairs[i].view)], light_of(model, i)};
    return pairs;
}

DirectionTable::DirectionTable(const BtfModel& model)
    : model_(&model), measured_(direction_pairs(model)), kept_(kept_pairs(model)) {}

PictureWeights DirectionTable::weights(const BtfDirection& view, const BtfDirection& light) const {
    const BtfTables& tables = model_->tables;
    const auto colours = static_cast<std::size_t>(model_->colours), planes = tables.weight_units.size();
    PictureWeights result{std::vector<double>(colours), std::vector<double>(colours),
                          std::vector<double>(colours * planes)};
    for (const PairWeight& of : measured_.interpolate({view, light})) {
        const double upward = std::cos(light_of(*model_, of.pair).theta);
        for (std::size_t c = 0; c < colours; ++c) {
            // The logarithm of what a matt surface would have everywhere. A black picture is nearly so.
            const double mean =
                std::max(static_cast<double>(tables.mean[of.pair * colours + c]), 1e-7 * model_->white);
            result.mean[c] += of.weight * std::log(mean / upward);
        }
    }
    const double upward = std::cos(std::min(light.theta, measured_.steepest_light()));
    for (double& mean : result.mean) mean = std::exp(mean) * upward;
    add_weights({view, light}, result);
    return result;
}

void DirectionTable::add_weights(const DirectionPair& at, PictureWeights& result) const {
    const BtfTables& tables = model_->tables;
    const auto colours = static_cast<std::size_t>(model_->colours), planes = tables.weight_units.size();
    for (const PairWeight& of : kept_.interpolate(at))
        for (std::size_t c = 0; c < colours; ++c) {
            const std::size_t row = of.pair * colours + c;
            result.offsets[c] += of.weight * tables.offset_unit * tables.offsets[row];
            for (std::size_t k = 0; k < planes; ++k)
                result.weights[c * planes + k] +=
                    of.weight * tables.weight_units[k] * tables.weights[row * planes + k];
        }
}

std::vector<double> DirectionTable::mean_squares(const DirectionPair& at, const Eigen::VectorXd& mean,
                                                 const Eigen::MatrixXd& moments) const {
    const auto colours = static_cast<std::size_t>(model_->colours);
    const auto planes = static_cast<std::size_t>(mean.size());
    PictureWeights of{{}, std::vector<double>(colours), std::vector<double>(colours * planes)};
    add_weights(at, of);
    std::vector<double> result;
    for (std::size_t c = 0; c < colours; ++c) {
        const Eigen::Map<const Eigen::VectorXd> u(of.weights.data() + c * planes, mean.size());
        const double offset = of.offsets[c];
        result.push_back(offset * offset + 2.0 * offset * u.dot(mean) + u.dot(moments * u));
    }
    return result;
}

}  // namespace btfield::detail
