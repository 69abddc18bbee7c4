#include "host/fit/correlated_support.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <utility>

#include "btfield/error.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

double correlation(const LagCovariance& statistic, Offset s) {
    double sum = 0.0;
    for (int i = 0; i < statistic.planes(); ++i)
        sum += std::abs(statistic(i, i, s)) / statistic(i, i, Offset{});
    return sum / statistic.planes();
}

std::string three_digits(double correlation) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3f", correlation);
    return text;
}

}  // namespace

std::vector<Offset> correlated_candidates(NeighbourhoodKind kind, int count) {
    const std::string asked = "keep the " + std::to_string(count) + " most correlated offsets";
    if (kind == NeighbourhoodKind::custom) {
        throw InputError(asked, "a custom neighbourhood lists its offsets already",
                         "use a symmetric, half, causal or unilateral one");
    }
    std::vector<Offset> candidates = neighbourhood(max_order, kind);
    if (count < 1 || static_cast<size_t>(count) > candidates.size()) {
        throw InputError(asked,
                         "there are " + std::to_string(candidates.size()) + " " + std::string(name(kind)) +
                             " offsets to choose from",
                         "use 1 to " + std::to_string(candidates.size()));
    }
    if (kind == NeighbourhoodKind::symmetric && count % 2 != 0) {
        throw InputError(asked, "symmetric neighbourhoods keep s and -s together",
                         "use an even number, such as " + std::to_string(count + 1));
    }
    return candidates;
}

CorrelatedSupport correlated_support(const LagCovariance& statistic, const Support& candidates, int count) {
    const bool pairs = candidates.kind == NeighbourhoodKind::symmetric;
    std::vector<std::pair<double, Offset>> ranked;
    CorrelatedSupport result;
    std::vector<Offset>& kept = result.support.offsets;
    for (const Offset s : candidates.offsets) {
        if (s == Offset{}) kept.push_back(s);
        if (s != Offset{} && (!pairs || s < Offset{})) ranked.emplace_back(correlation(statistic, s), s);
    }
    std::ranges::stable_sort(ranked, [](const auto& a, const auto& b) { return a.first > b.first; });
    ranked.resize(static_cast<size_t>(pairs ? count / 2 : count));
    for (const auto& [value, s] : ranked) {
        kept.push_back(s);
        if (pairs) kept.push_back(-s);
    }
    std::ranges::sort(kept);
    result.support.active = candidates.active;
    result.weakest_kept = ranked.back().first;
    return result;
}

std::string correlated_reason(int count, NeighbourhoodKind kind, const std::vector<Offset>& candidates,
                              const std::vector<double>& weakest) {
    const auto centres = std::ranges::count(candidates, Offset{});
    std::string text = "the " + std::to_string(count) + " most correlated of " +
                       std::to_string(candidates.size() - static_cast<size_t>(centres)) + " " +
                       std::string(name(kind)) + " offsets, weakest correlation kept by level: ";
    for (size_t k = 0; k < weakest.size(); ++k) text += (k == 0 ? "" : ", ") + three_digits(weakest[k]);
    return text;
}

}  // namespace btfield::detail
