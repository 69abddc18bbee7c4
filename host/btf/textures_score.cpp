#include "host/btf/textures_score.hpp"

#include <algorithm>
#include <cmath>

#include "btfield/criteria.hpp"
#include "host/base/parallel.hpp"
#include "host/btf/direction_interpolation.hpp"
#include "host/btf/textures_directions.hpp"

namespace btfield::detail {
namespace {

constexpr std::size_t scored_at_once = 32;
constexpr std::uint64_t scored_seed = 1;

struct StatisticErrors {
    double mean = 0.0, deviation = 0.0, covariance = 0.0;
};

StatisticErrors statistic_errors(const Image& truth, const Image& found) {
    StatisticErrors result;
    const auto [flat, light] = std::ranges::minmax(truth.values());
    if (!(light > flat)) return result;  // nothing of it is off that a share could tell
    const Comparison comparison = compare(truth, found);
    const double share = 1.0 / truth.planes();
    for (const Comparison::Plane& plane : comparison.planes) {
        result.mean += share * std::abs(plane.mean[1] - plane.mean[0]) / std::max(plane.mean[0], 1e-12);
        result.deviation += share * std::abs(plane.std[1] - plane.std[0]) / std::max(plane.std[0], 1e-12);
    }
    result.covariance = comparison.lag_covariance_error;
    return result;
}

double quantile_at(std::vector<double> values, double share) {
    const auto at = static_cast<std::size_t>(std::lround(share * static_cast<double>(values.size() - 1)));
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
    return values[at];
}

BtfStatistics statistics_of(const std::vector<StatisticErrors>& all) {
    std::vector<double> means, deviations, covariances;
    for (const StatisticErrors& of : all) {
        means.push_back(of.mean);
        deviations.push_back(of.deviation);
        covariances.push_back(of.covariance);
    }
    return {quantile_at(means, 0.5), quantile_at(deviations, 0.5), quantile_at(deviations, 0.95),
            quantile_at(covariances, 0.5)};
}

}  // namespace

BtfTexturesScore score_textures(Device& device, const BtfSet& set, const BtfTextures& model,
                                const std::vector<BtfPair>& left_out,
                                const std::function<void(double)>& told) {
    const BtfTextureSynthesiser grown(device, model, set.size(), scored_seed, true);
    const TexturesDirections directions(model);
    std::vector<StatisticErrors> of_model(left_out.size()), of_nearest(left_out.size());
    for (std::size_t first = 0; first < left_out.size(); first += scored_at_once) {
        const std::size_t count = std::min(scored_at_once, left_out.size() - first);
        for_each_block(static_cast<int>(count), [&](int block) {
            const std::size_t i = first + static_cast<std::size_t>(block);
            const BtfPair& pair = left_out[i];
            const Image truth = set.picture(pair.view, pair.light);
            const BtfDirection view = set.views()[static_cast<std::size_t>(pair.view)],
                               light = set.light(pair.view, pair.light);
            of_model[i] = statistic_errors(truth, grown.picture(view, light));
            const BtfPair& near = model.pairs[directions.nearest(view, light)];
            of_nearest[i] = statistic_errors(truth, set.picture(near.view, near.light));
        });
        told(static_cast<double>(first + count) / static_cast<double>(left_out.size()));
    }
    return {left_out, statistics_of(of_model), statistics_of(of_nearest)};
}

}  // namespace btfield::detail
