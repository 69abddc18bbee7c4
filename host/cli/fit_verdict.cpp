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

bool varies(const Image& image) {
    for (int p = 0; p < image.planes(); ++p)
        if (std::ranges::any_of(image.plane(p), [&](float v) { return v != image.plane(p).front(); }))
            return true;
    return false;
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

bool has_colours(int planes, ColourSpace space, const std::vector<ColourSpace>& of_planes) {
    if (space != ColourSpace::unspecified) return planes > 1;
    return std::ranges::count_if(of_planes, [](ColourSpace own) { return own != ColourSpace::unspecified; }) >
           1;
}

/// Whether planes that are seen differ: grey stored as RGB has one eigenplane.
template <typename AnyModel>
bool has_colours(const AnyModel& model, const SpectralBasis& basis) {
    return has_colours(model.planes, model.space, model.plane_spaces) &&
           (basis.planes == 0 || basis.rank > 1);
}

std::string distances_text(const FitVerdict& verdict) {
    std::string text = "structure distance " + number_text(verdict.structure_distance);
    if (verdict.maps.size() > 1)
        for (const FitVerdict::OfMap& map : verdict.maps)
            if (std::isfinite(map.structure_distance))
                text += ", of " + map.name + " alone " + number_text(map.structure_distance);
    return text + ", where " + number_text(FitVerdict::noticeable_structure) + " hardly shows";
}

/// Of a compound model's CBOR file by default options, at most: labels at 1.4 bit a pixel, and of each of
/// 12 regions 50 numbers to a pair of planes and 45 to a plane. Files of 25 pictures and material sets of
/// 256² to 1024², 1 to 6 planes, were 0.35 to 0.96 of it.
std::string most_compound_bytes(const TextureModel& model) {
    const auto d = static_cast<double>(model.planes);
    const double bytes =
        0.175 * static_cast<double>(area(model.size)) + 12.0 * (50.0 * d * d + 45.0 * d) * 8.0;
    if (bytes >= 995e3) return number_text(std::ceil(bytes / 1e5) / 10.0) + " MB";
    return number_text(10.0 * std::ceil(bytes / 1e4)) + " kB";
}

/// What compound models do better: of maps only the shapes of colours are sure to come nearer.
std::string compound_proposal(const FitVerdict& verdict, const TextureModel& model) {
    const bool maps = !verdict.maps.empty();
    const bool in_colour = std::ranges::any_of(verdict.maps, [](const FitVerdict::OfMap& map) {
        return map.role == MapRole::colour && map.structure_distance > FitVerdict::noticeable_structure;
    });
    return std::string("'btfield compound fit") +
           (maps ? " --joint' of the same maps " : "' of the same picture ") +
           (!maps       ? "keeps more of them"
            : in_colour ? "keeps more of those in colour, of others it may not"
                        : "may keep more of them") +
           ", in up to " + most_compound_bytes(model) + " (.btfm)";
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
    FitVerdict verdict;
    if (!maps.empty()) {
        const std::vector<Image> grown = split_maps(device, maps, texture, SurfaceEdges::periodic);
        std::vector<MaterialMap> measured(maps.begin(), maps.end());
        for (MaterialMap& map : measured) map.gains.clear();
        const std::vector<Image> given = split_maps(device, measured, part, SurfaceEdges::mirror);
        for (std::size_t m = 0; m < maps.size(); ++m)
            if (varies(given[m]))
                verdict.maps.push_back({maps[m].name, maps[m].role, structure_distance(given[m], grown[m])});
        texture = seen(grown);
        part = seen(given);
    }
    verdict.lag_covariance_error = compare(part, texture).lag_covariance_error;
    verdict.structure_distance = structure_distance(part, texture);
    return verdict;
}

std::string verdict_text(const FitVerdict& verdict, const TextureModel& model, const FitOptions& options) {
    const bool marginals = !model.marginals.empty();
    const bool colours = has_colours(model, model.basis);
    std::string text = std::string("It keeps ") +
                       (model.planes == 1 ? "mean"
                        : colours         ? "means and colours"
                                          : "means") +
                       (marginals ? ", histograms" : "") + ", and correlations of pixels to " +
                       percent(verdict.lag_covariance_error) + " of the variance";
    const std::string nearer = verdict.lag_covariance_error > noticeable_lag_error ? proposals(options) : "";
    text += (nearer.empty() ? "" : ": " + nearer) + ".\n";
    text += silent_levels(model);
    if (verdict.loses_shapes())
        text += "It loses shapes: " + distances_text(verdict) + ". " + compound_proposal(verdict, model) +
                "; 'btfield roll' lays the picture's own patches.\n";
    return text;
}

std::string verdict_text(const FitVerdict& verdict, const CompoundModel& model) {
    const bool colours = has_colours(model, model.regions.front().residual.basis);
    std::string text = std::string("It keeps the ") + (colours ? "colours of " : "means of ") +
                       detail::counted(model.regions.size(), "region") +
                       " and their shares, and correlations of pixels to " +
                       percent(verdict.lag_covariance_error) + " of the variance.\n";
    const std::string distance = distances_text(verdict);
    if (verdict.loses_shapes())
        text += "Shapes are kept in part: " + distance +
                ". Another number of --regions may come nearer; 'btfield roll' lays the picture's own "
                "patches, and needs the picture.\n";
    else if (std::isfinite(verdict.structure_distance))
        text += "It keeps shapes: " + distance + ".\n";
    return text;
}

}  // namespace btfield::cli
