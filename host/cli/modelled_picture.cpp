#include "host/cli/modelled_picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/light_trend.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"
#include "host/relief/relief_names.hpp"

namespace btfield::cli {

Provenance provenance_of(const std::filesystem::path& path, const Picture& picture) {
    Provenance result;
    result.source = path.filename().string();
    result.type = picture.type;
    result.picture_bytes = static_cast<std::uint64_t>(picture.image.values().size()) *
                           static_cast<std::uint64_t>(bytes_per_value(picture.type));
    result.software = "btfield " BTFIELD_VERSION;
    result.chromaticities = picture.chromaticities;
    result.file_bytes = picture.file_bytes;
    std::vector<PlaneLimits> limits = plane_limits(picture.image);
    const auto reached = [](PlaneLimits own) { return own.low || own.high; };
    if (std::ranges::any_of(limits, reached)) result.limits = std::move(limits);
    return result;
}

void add_flattening(CLI::App& app, Flattening& flattening) {
    add_choice(app, "--flatten", flattening,
               "take nothing out of the picture's light, the slope that fits best, or the slope and bowl: "
               "colours are divided by it, other planes have it subtracted (default: none)");
}

namespace {

/// Of its light, one that can be divided out; empty where none can.
std::string flattening_advice(const Image& image, Flattening shape) {
    for (const Flattening each : {shape, Flattening::plane, Flattening::low}) try {
            static_cast<void>(flattened(image, each));
            return "--flatten " + std::string(detail::word_of(each)) + " takes it out";
        } catch (const InputError&) {  // the next, then
        }
    return {};
}

/// Planes of which flattening leaves nothing, or hardly anything.
void warn_of_planes_left(const std::string& of, const FlattenedPicture& flat, const std::string& option) {
    constexpr double hardly = 1e-3;
    std::string none;
    for (std::size_t p = 0; p < flat.left.size(); ++p) {
        const std::string plane =
            p < flat.image.names().size() ? flat.image.names()[p] : "plane " + std::to_string(p);
        if (flat.left[p] == 0.0)
            none += (none.empty() ? "" : ", ") + plane;
        else if (flat.left[p] < hardly)
            warn("'" + of + "': " + option + " leaves " + number_text(100.0 * flat.left[p]) +
                 " % of the variance of " + plane + ", and textures have no more of it");
    }
    if (!none.empty())
        warn("'" + of + "': " + option + " leaves nothing of " + none + ": constant in textures");
}

}  // namespace

std::string flatten_light(const std::string& of, Image& image, Flattening flattening) {
    const auto percents = [](double share) { return std::to_string(std::lround(100.0 * share)) + " %"; };
    if (flattening == Flattening::none) {
        if (const auto trend = light_trend(image)) {
            const std::string advice = flattening_advice(image, trend->shape);
            warn("'" + of + "': light is uneven, brightness has a trend of " + percents(trend->range) +
                 " over the picture, which textures take for contrast of the material" +
                 (advice.empty() ? "" : "; " + advice));
        }
        return {};
    }
    try {
        FlattenedPicture flat = flattened(image, flattening);
        warn_of_planes_left(of, flat, "--flatten " + std::string(detail::word_of(flattening)));
        image = std::move(flat.image);
        const bool colours = image.space() != ColourSpace::unspecified || !image.plane_spaces().empty();
        return "flattened (--flatten " + std::string(detail::word_of(flattening)) +
               "): before the fit a trend of " + percents(flat.range) + " of the " +
               (colours ? "mean brightness" : "standard deviation") + " over the picture was taken out";
    } catch (const InputError& error) {
        throw InputError(error.asked() + " '" + of + "'", error.found(), error.remedy());
    }
}

}  // namespace btfield::cli
