#include "host/cli/fit_verdict.hpp"

#include <algorithm>
#include <cmath>

#include "btfield/criteria.hpp"
#include "host/base/text.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {
namespace {

constexpr int largest_judged = 512;
/// Two halves of one picture differ by as much.
constexpr double noticeable_lag_error = 0.06;

std::string percent(double share) {
    return number_text(std::round(1000.0 * share) / 10.0) + " %";
}

/// What may keep correlations better and was not asked for; empty: nothing.
std::string proposals(const FitOptions& options) {
    if (options.choose_model) return {};
    constexpr int highest_order = 8;
    std::string some = options.order < highest_order && options.correlated == 0 ? "--order 8" : "";
    if (options.model != ModelKind::msar3d)
        some += std::string(some.empty() ? "" : " or ") + "--model 3d-msar";
    return (some.empty() ? "" : some + " may come nearer, ") +
           "--model auto --order auto --levels auto tries all models and orders, in two to four times the "
           "time";
}

/// All planes of the maps side by side.
Image seen(const std::vector<Image>& maps) {
    int planes = 0;
    for (const Image& map : maps) planes += map.planes();
    Image all(maps.front().size(), planes);
    int plane = 0;
    for (const Image& map : maps)
        for (int p = 0; p < map.planes(); ++p) std::ranges::copy(map.plane(p), all.plane(plane++).begin());
    return all;
}

/// Levels that textures get nothing of.
std::string silent_levels(const TextureModel& model) {
    std::string numbers;
    int count = 0;
    for (std::size_t level = 0; level < model.levels.size(); ++level) {
        if (model.levels[level].gain > 0.0) continue;
        numbers += (count++ == 0 ? "" : ", ") + std::to_string(level);
    }
    if (count == 0) return {};
    return std::string(count == 1 ? "Level " : "Levels ") + numbers + (count == 1 ? " has" : " have") +
           " no share in textures (gain 0): the others alone are nearest to the picture's correlations. "
           "--levels 1 does without levels.\n";
}

}  // namespace

FitVerdict verdict_on(Device& device, const Image& picture, std::span<const MaterialMap> maps,
                      const std::function<Image(Size)>& grow) {
    const Size size{std::min(picture.height(), largest_judged), std::min(picture.width(), largest_judged)};
    Image part = picture.crop((picture.height() - size.height) / 2, (picture.width() - size.width) / 2, size);
    Image texture = grow(size);
    if (!maps.empty()) {
        texture = seen(split_maps(device, maps, texture, SurfaceEdges::periodic));
        std::vector<MaterialMap> measured(maps.begin(), maps.end());
        for (MaterialMap& map : measured) map.gains.clear();
        part = seen(split_maps(device, measured, part, SurfaceEdges::mirror));
    }
    return {compare(part, texture).lag_covariance_error, structure_distance(part, texture)};
}

std::string verdict_text(const FitVerdict& verdict, const TextureModel& model, const FitOptions& options) {
    const bool marginals = !model.marginals.empty();
    std::string text = std::string("It keeps ") + (model.planes == 1 ? "mean" : "means and colours") +
                       (marginals ? ", histograms" : "") + ", and correlations of pixels to " +
                       percent(verdict.lag_covariance_error) + " of the variance";
    const std::string nearer = verdict.lag_covariance_error > noticeable_lag_error ? proposals(options) : "";
    text += (nearer.empty() ? "" : ": " + nearer) + ".\n";
    text += silent_levels(model);
    if (verdict.loses_shapes())
        text +=
            "It loses shapes: structure distance " + number_text(verdict.structure_distance) +
            ", where 0.07 hardly shows. 'btfield compound fit' of the same picture keeps them, in tens of "
            "kilobytes; 'btfield roll' lays the picture's own patches.\n";
    return text;
}

std::string verdict_text(const FitVerdict& verdict, const CompoundModel& model) {
    std::string text = "It keeps the colours of " + detail::counted(model.regions.size(), "region") +
                       " and their shares, and correlations of pixels to " +
                       percent(verdict.lag_covariance_error) + " of the variance.\n";
    const std::string distance = "structure distance " + number_text(verdict.structure_distance) +
                                 ", where " + number_text(FitVerdict::noticeable_structure) + " hardly shows";
    if (verdict.loses_shapes())
        text += "Shapes are kept in part: " + distance +
                ". Another number of --regions may come nearer; 'btfield roll' lays the picture's own "
                "patches, and needs the picture.\n";
    else if (std::isfinite(verdict.structure_distance))
        text += "It keeps shapes: " + distance + ".\n";
    return text;
}

}  // namespace btfield::cli
