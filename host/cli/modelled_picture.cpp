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

std::string flatten_light(const std::string& of, Image& image, Flattening flattening) {
    const auto percents = [](double share) { return std::to_string(std::lround(100.0 * share)) + " %"; };
    if (flattening == Flattening::none) {
        if (const auto trend = light_trend(image)) {
            const std::string word(detail::word_of(trend->shape));
            warn("'" + of + "': light is uneven, brightness has a trend of " + percents(trend->range) +
                 " over the picture, which textures take for contrast of the material; --flatten " + word +
                 " takes it out");
        }
        return {};
    }
    try {
        FlattenedPicture flat = flattened(image, flattening);
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
