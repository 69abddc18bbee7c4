#include "host/cli/fit_verdict.hpp"

#include <algorithm>
#include <cmath>

#include "btfield/criteria.hpp"
#include "btfield/lag_covariance.hpp"
#include "btfield/theory.hpp"
#include "host/base/text.hpp"
#include "host/cli/report.hpp"

namespace btfield::cli {
namespace {

constexpr int largest_judged = 512;
/// Two halves of one picture differ by as much.
constexpr double noticeable_lag_error = 0.06;
/// Correlations that are further off are not kept.
constexpr double largest_lag_error = 0.2;
/// From this structure distance on a texture with regions looks like one without.
constexpr double lost_by_regions = 0.3;
/// Share of a deviation that must be missing, or too much, to be told; and to be called a loss.
constexpr double noticeable_deviation = 0.05, largest_deviation = 0.15;

std::string percent(double share) {
    return number_text(std::round(1000.0 * share) / 10.0) + " %";
}

/// "a, b or c".
std::string listed(const std::vector<std::string>& words, const std::string& last) {
    std::string text;
    for (std::size_t i = 0; i < words.size(); ++i)
        text += (i == 0 ? "" : i + 1 < words.size() ? ", " : last) + words[i];
    return text;
}

/// What may come nearer and was not asked for; empty: nothing.
std::string proposals(const TextureModel& model, const FitOptions& options) {
    if (options.choose_model) return {};
    constexpr int highest_order = 8;
    std::vector<std::string> some;
    // Without the coarse ones long waves are lost.
    if (const int levels = default_levels(model.size, model.factor);
        !options.choose_levels && static_cast<int>(model.levels.size()) < levels)
        some.push_back("--levels " + std::to_string(levels));
    if (options.order < highest_order && options.correlated == 0) some.emplace_back("--order 8");
    if (options.model != ModelKind::msar3d) some.emplace_back("--model 3d-msar");
    return (some.empty() ? "" : listed(some, " or ") + " may come nearer, ") +
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
/// 12 regions 85 numbers to a pair of planes and 50 to a plane. Files of ten pictures and material sets of
/// 256² to 1024², 3 to 5 planes, were 0.25 to 0.75 of it.
std::string most_compound_bytes(const TextureModel& model) {
    const auto d = static_cast<double>(model.planes);
    const double bytes =
        0.175 * static_cast<double>(area(model.size)) + 12.0 * (85.0 * d * d + 50.0 * d) * 8.0;
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
           " no share in textures (gain 0): the others alone are nearest to the picture's correlations.\n";
}

/// The middle of it that textures are compared with.
Size judged(const Image& picture) {
    return {std::min(picture.height(), largest_judged), std::min(picture.width(), largest_judged)};
}

Image middle(const Image& image, Size size) {
    return image.crop((image.height() - size.height) / 2, (image.width() - size.width) / 2, size);
}

/// Mean over all planes that vary.
double lag_error(const std::vector<Image>& given, const std::vector<Image>& grown) {
    double sum = 0.0;
    int varying = 0;
    for (std::size_t m = 0; m < given.size(); ++m) {
        for (int p = 0; p < given[m].planes(); ++p) {
            Image a(given[m].size(), 1), b(grown[m].size(), 1);
            std::ranges::copy(given[m].plane(p), a.plane(0).begin());
            std::ranges::copy(grown[m].plane(p), b.plane(0).begin());
            if (!varies(a)) continue;
            sum += compare(a, b).lag_covariance_error;
            ++varying;
        }
    }
    return varying == 0 ? 0.0 : sum / varying;
}

/// What of it a texture tells.
FitVerdict verdict_of(Device& device, const Image& picture, std::span<const MaterialMap> maps,
                      const Image& texture) {
    const Size size = texture.size();
    FitVerdict verdict;
    if (maps.empty()) {
        verdict.lag_covariance_error = compare(picture, texture).lag_covariance_error;
        verdict.structure_distance = structure_distance(middle(picture, size), texture);
        return verdict;
    }
    const std::vector<Image> grown = split_maps(device, maps, texture, SurfaceEdges::periodic);
    std::vector<MaterialMap> measured(maps.begin(), maps.end());
    for (MaterialMap& map : measured) map.gains.clear();
    const std::vector<Image> given = split_maps(device, measured, picture, SurfaceEdges::mirror);
    std::vector<Image> parts;
    for (std::size_t m = 0; m < maps.size(); ++m) {
        parts.push_back(middle(given[m], size));
        if (varies(parts[m]))
            verdict.maps.push_back({maps[m].name, maps[m].role, structure_distance(parts[m], grown[m])});
    }
    verdict.lag_covariance_error = lag_error(given, grown);
    verdict.structure_distance = structure_distance(seen(parts), seen(grown));
    return verdict;
}

/// Covariances that a model promises of textures of the picture's size, beside the picture's.
class Promise {
  public:
    Promise(const Image& picture, const TextureModel& model)
        : planes_(static_cast<std::size_t>(picture.planes())),
          lags_(probe_lags(picture.size())),
          measured_(covariances_at(picture, lags_)),
          promised_(theoretical_covariance(model, picture.size(), lags_)) {}

    /// Mean over lags, and over planes that vary, as compare() has it.
    [[nodiscard]] double lag_covariance_error() const {
        double sum = 0.0;
        int varying = 0;
        for (std::size_t i = 0; i < planes_; ++i) {
            const double variance = measured_[place(0, i)];
            if (!(variance > 0.0)) continue;
            ++varying;
            for (std::size_t s = 0; s < lags_.size(); ++s)
                sum += std::abs(promised_[place(s, i)] - measured_[place(s, i)]) / variance;
        }
        return varying == 0 ? 0.0 : sum / static_cast<double>(lags_.size()) / varying;
    }

    /// Of textures to the picture's: the quadratic mean over these planes, but those that are constant.
    [[nodiscard]] double deviation(int first, int count) const {
        double sum = 0.0;
        int varying = 0;
        for (int p = first; p < first + count; ++p) {
            const std::size_t at = place(0, static_cast<std::size_t>(p));
            if (!(measured_[at] > 0.0)) continue;
            sum += promised_[at] / measured_[at];
            ++varying;
        }
        return varying == 0 ? 1.0 : std::sqrt(sum / varying);
    }

  private:
    [[nodiscard]] std::size_t place(std::size_t lag, std::size_t plane) const {
        return (lag * planes_ + plane) * planes_ + plane;
    }

    std::size_t planes_;
    std::vector<Offset> lags_;
    std::vector<double> measured_, promised_;
};

double deviation(const Image& image, int plane) {
    double sum = 0.0, squares = 0.0;
    for (const float v : image.plane(plane)) {
        sum += static_cast<double>(v);
        squares += static_cast<double>(v) * static_cast<double>(v);
    }
    const auto pixels = static_cast<double>(image.plane(plane).size());
    return std::sqrt(std::max(0.0, squares / pixels - sum / pixels * (sum / pixels)));
}

/// Heights are grown with gains, which take some of their deviation.
void keep_gains(FitVerdict& verdict, Device& device, std::span<const MaterialMap> maps,
                const Image& texture) {
    int plane = 0;
    for (const MaterialMap& map : maps) {
        const int own = plane;
        plane += map.planes;
        const double whole = map.gains.empty() ? 0.0 : deviation(texture, own);
        if (!(whole > 0.0)) continue;
        MaterialMap alone = map;
        Image height(texture.size(), 1);
        std::ranges::copy(texture.plane(own), height.plane(0).begin());
        const std::vector<Image> grown =
            split_maps(device, std::span<const MaterialMap>(&alone, 1), height, SurfaceEdges::periodic);
        for (FitVerdict::Deviation& each : verdict.deviations)
            if (each.of == map.name) each.share *= deviation(grown.front(), 0) / whole;
    }
}

/// Correlations are kept beside the rest, or lost.
std::string kept_text(std::vector<std::string> kept, const FitVerdict& verdict) {
    const std::string off = percent(verdict.lag_covariance_error) + " of the variance";
    if (verdict.lag_covariance_error > largest_lag_error)
        return listed(kept, " and ") + ".\nIt loses correlations: those of pixels are off by " + off;
    kept.push_back("correlations of pixels to " + off);
    return listed(kept, ", and ");
}

/// Deviations that are off, those that are lost, and whether any is.
struct DeviationText {
    std::string text;
    bool lost = false;
};

DeviationText deviation_text(const FitVerdict& verdict) {
    DeviationText told;
    std::string list;
    for (const FitVerdict::Deviation& each : verdict.deviations) {
        const double off = std::abs(1.0 - each.share);
        if (!(off > noticeable_deviation)) continue;
        told.lost = told.lost || off > largest_deviation;
        list += (list.empty() ? "" : ", ") + percent(each.share) + " of the deviation of " +
                (each.of.empty() ? "the picture" : each.of);
    }
    if (list.empty()) return told;
    told.text = (told.lost ? "It loses contrast: textures have " : "Textures have ") + list;
    return told;
}

}  // namespace

FitVerdict verdict_on(Device& device, const Image& picture, const TextureModel& model,
                      const std::function<Image(Size)>& grow) {
    const std::vector<MaterialMap>& maps = model.provenance.maps;
    const Image texture = grow(judged(picture));
    FitVerdict verdict = verdict_of(device, picture, maps, texture);
    const Promise promise(picture, model);
    if (maps.empty()) {
        verdict.lag_covariance_error = promise.lag_covariance_error();
        verdict.deviations.push_back({{}, promise.deviation(0, picture.planes())});
    }
    int plane = 0;
    for (const MaterialMap& map : maps) {
        if (map.planes > 0 && map.role != MapRole::normal)
            verdict.deviations.push_back({map.name, promise.deviation(plane, map.planes)});
        plane += map.planes;
    }
    keep_gains(verdict, device, maps, texture);
    return verdict;
}

FitVerdict verdict_on(Device& device, const Image& picture, const CompoundModel& model,
                      const std::function<Image(Size)>& grow) {
    const std::vector<MaterialMap>& maps = model.provenance.maps;
    const Image texture = grow(judged(picture));
    FitVerdict verdict = verdict_of(device, picture, maps, texture);
    for (const MaterialMap& map : maps)
        if (!map.gains.empty()) verdict.deviations.push_back({map.name, 1.0});
    keep_gains(verdict, device, maps, texture);
    return verdict;
}

std::string verdict_text(const FitVerdict& verdict, const TextureModel& model, const FitOptions& options) {
    const bool marginals = !model.marginals.empty();
    const bool colours = has_colours(model, model.basis);
    const bool correlated = verdict.lag_covariance_error <= largest_lag_error;
    std::vector<std::string> kept{model.planes == 1 ? "mean" : "means"};
    if (colours) kept.emplace_back("colours");
    if (marginals) kept.emplace_back("histograms");
    std::string text = "It keeps " + kept_text(kept, verdict);
    const DeviationText deviations = deviation_text(verdict);
    if (!deviations.text.empty()) text += ".\n" + deviations.text;
    const bool off = verdict.lag_covariance_error > noticeable_lag_error || !deviations.text.empty();
    const std::string nearer = off ? proposals(model, options) : "";
    text += (nearer.empty() ? "" : ": " + nearer) + ".\n";
    text += silent_levels(model);
    if (verdict.loses_shapes())
        text += "It loses shapes: " + distances_text(verdict) + ". " + compound_proposal(verdict, model) +
                "; 'btfield roll' lays the picture's own patches.\n";
    else if (deviations.lost || !correlated)
        text += "'btfield roll' lays the picture's own patches and keeps all of it.\n";
    return text;
}

std::string verdict_text(const FitVerdict& verdict, const CompoundModel& model) {
    const bool colours = has_colours(model, model.regions.front().residual.basis);
    std::string text = "It keeps " +
                       kept_text({std::string(colours ? "the colours of " : "the means of ") +
                                      detail::counted(model.regions.size(), "region"),
                                  "their shares"},
                                 verdict) +
                       ".\n";
    if (const DeviationText deviations = deviation_text(verdict); !deviations.text.empty())
        text += deviations.text + ".\n";
    const std::string distance = distances_text(verdict);
    if (verdict.loses_shapes())
        text += (verdict.structure_distance > lost_by_regions ? "It loses shapes: "
                                                              : "Shapes are kept in part: ") +
                distance +
                (model.borders != Borders::conditional ? ". --borders conditional keeps more"
                                                       : ". Another number of --regions may come nearer") +
                "; 'btfield roll' lays the picture's own patches, and needs the picture.\n";
    else if (std::isfinite(verdict.structure_distance))
        text += "It keeps shapes: " + distance + ".\n";
    return text;
}

}  // namespace btfield::cli
