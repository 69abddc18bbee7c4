#include "host/btf/btf_score.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/parallel.hpp"
#include "host/btf/direction_table.hpp"

namespace btfield::detail {
namespace {

struct Moments {
    double mean = 0.0, deviation = 0.0;
};

Moments moments(std::span<const float> values) {
    double sum = 0.0, squares = 0.0;
    for (const float value : values) sum += static_cast<double>(value);
    const double mean = sum / static_cast<double>(values.size());
    for (const float value : values) {
        const double deviation = static_cast<double>(value) - mean;
        squares += deviation * deviation;
    }
    return {mean, std::sqrt(squares / static_cast<double>(values.size()))};
}

/// Of one picture.
struct Differences {
    double pixels = 0.0, mean = 0.0, deviation = 0.0;
};

Differences differences(const Image& truth, const Image& found) {
    Differences result;
    double squares = 0.0, variance = 0.0;
    for (int c = 0; c < truth.planes(); ++c) {
        const auto a = truth.plane(c), b = found.plane(c);
        const Moments of_truth = moments(a), of_found = moments(b);
        double sum = 0.0;
        for (std::size_t p = 0; p < a.size(); ++p) {
            const double difference = static_cast<double>(b[p]) - static_cast<double>(a[p]);
            sum += difference * difference;
        }
        squares += sum / static_cast<double>(a.size());
        variance += of_truth.deviation * of_truth.deviation;
        const double share = 1.0 / truth.planes();
        result.mean += share * std::abs(of_found.mean - of_truth.mean) / std::max(of_truth.mean, 1e-12);
        result.deviation +=
            share * std::abs(of_found.deviation - of_truth.deviation) / std::max(of_truth.deviation, 1e-12);
    }
    result.pixels = std::sqrt(squares / std::max(variance, 1e-24));
    return result;
}

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

BtfErrors summary(const std::vector<Differences>& all) {
    std::vector<double> pixels, means, deviations;
    for (const Differences& of : all) {
        pixels.push_back(of.pixels);
        means.push_back(of.mean);
        deviations.push_back(of.deviation);
    }
    double sum = 0.0;
    for (const double value : pixels) sum += value;
    return {median(pixels), sum / static_cast<double>(pixels.size()), median(means), median(deviations)};
}

/// Those next to a pair, mixed.
Image mixed(const BtfSet& set, const BtfModel& model, const std::vector<PairWeight>& near) {
    Image result(set.size(), set.planes());
    double total = 0.0;
    for (const PairWeight& of : near) total += std::pow(of.weight + 1e-9, -4.0);
    for (const PairWeight& of : near) {
        const BtfPair& pair = model.pairs[of.pair];
        const Image picture = set.picture(pair.view, pair.light);
        const auto share = static_cast<float>(std::pow(of.weight + 1e-9, -4.0) / total);
        for (std::size_t i = 0; i < result.values().size(); ++i)
            result.values()[i] += share * picture.values()[i];
    }
    return result;
}

}  // namespace

BtfScore score(Device& device, const BtfSet& set, const BtfFit& fit, const std::vector<BtfPair>& left_out) {
    const BtfSynthesiser shown(device, fit.model, fit.surface);
    const DirectionTable table(fit.model);
    std::vector<Differences> model(left_out.size()), nearest(left_out.size()), neighbours(left_out.size());
    for_each_block(static_cast<int>(left_out.size()), [&](int block) {
        const auto i = static_cast<std::size_t>(block);
        const BtfPair& pair = left_out[i];
        const Image truth = set.picture(pair.view, pair.light);
        const BtfDirection view = set.views()[static_cast<std::size_t>(pair.view)],
                           light = set.light(pair.view, pair.light);
        model[i] = differences(truth, shown.picture(view, light));
        std::vector<PairWeight> near = table.measured().nearest({view, light}, 4);
        neighbours[i] = differences(truth, mixed(set, fit.model, near));
        near.resize(1);
        nearest[i] = differences(truth, mixed(set, fit.model, near));
    });
    return {left_out, summary(model), summary(nearest), summary(neighbours)};
}

}  // namespace btfield::detail
