#include "host/cli/compound_report.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "host/base/text.hpp"
#include "host/cli/model_report.hpp"

namespace btfield::cli {
namespace {

/// Of all levels of a region: valid when each is, and the least singular value.
Json region_certificate(const TextureModel& residual) {
    Certificate all;
    all.valid = is_valid(residual);
    all.min_singular = std::numeric_limits<double>::infinity();
    for (const LevelModel& level : residual.levels) {
        all.min_singular = std::min(all.min_singular, level.certificate.min_singular);
        all.zeros += level.certificate.zeros;
    }
    // Of the finest level, which has nearly all of the pixels.
    all.variance_ratio = residual.levels.front().certificate.variance_ratio;
    return certificate_json(all);
}

Json region_json(const CompoundRegion& region) {
    Json levels = Json::array();
    for (const LevelModel& level : region.residual.levels) {
        Json object;
        object["size"] = size_json(level.size);
        object["offsets"] = linear_field(level.models.front()).offsets.size();
        object["estimator"] = name(level.estimator);
        object["gain"] = number(level.gain);
        object["certificate"] = certificate_json(level.certificate);
        levels.push_back(std::move(object));
    }
    Json object;
    object["share"] = number(region.share);
    object["pixels"] = region.pixels;
    object["model"] = name(region.residual.kind);
    object["colour"] = region.colour;
    object["contrast"] = number(region.contrast);
    object["certificate"] = region_certificate(region.residual);
    object["levels"] = std::move(levels);
    return object;
}

constexpr std::size_t most_means = 4;  // of a region in the table

std::string colour_text(const std::vector<double>& colour) {
    std::string text;
    for (std::size_t p = 0; p < colour.size() && p < most_means; ++p)
        text += (p > 0 ? " " : "") + number_text(colour[p]);
    return colour.size() > most_means ? text + " ..." : text;
}

/// What a region's numbers are, in their order.
std::string colour_heading(const CompoundModel& model) {
    const auto planes = static_cast<std::size_t>(model.planes);
    if (planes == 1) return "mean";
    if (planes == 3 && (model.space != ColourSpace::unspecified || model.names.empty())) return "colour";
    std::string text = "means of ";
    for (std::size_t p = 0; p < planes && p < most_means; ++p)
        text += (p > 0 ? ", " : "") + (model.names.empty() ? "plane " + std::to_string(p) : model.names[p]);
    return planes > most_means ? text + ", ..." : text;
}

std::string valid_text(const TextureModel& residual) {
    std::string text;
    for (std::size_t l = 0; l < residual.levels.size(); ++l)
        if (!residual.levels[l].certificate.valid)
            text += (text.empty() ? "FAILS at level " : ", ") + std::to_string(l);
    return text.empty() ? "valid" : text;
}

}  // namespace

Json compound_json(const CompoundModel& model, const std::filesystem::path& path, std::uintmax_t bytes) {
    Json regions = Json::array();
    for (const CompoundRegion& region : model.regions) regions.push_back(region_json(region));
    Json object;
    object["model"] = "compound";
    object["output"] = path.string();
    object["source"] = model.provenance.source;
    object["planes"] = model.planes;
    object["size"] = size_json(model.size);
    object["colour_space"] = name(model.space);
    if (!model.names.empty()) object["names"] = model.names;
    for (const ColourSpace space : model.plane_spaces) object["plane_colour_spaces"].push_back(name(space));
    if (!model.provenance.maps.empty()) object["maps"] = maps_json(model.provenance.maps);
    object["borders"] = name(model.borders);
    object["explained"] = number(model.explained);
    object["control"]["size"] = size_json(model.control.size);
    object["control"]["tile"] = model.periodic;
    object["regions"] = std::move(regions);
    object["parameters"] = parameter_count(model);
    object["bytes"] = bytes;
    object["compression_ratio"] = number(compression_ratio(model.provenance, bytes));
    return object;
}

std::string compound_text(const CompoundModel& model, std::uintmax_t bytes) {
    std::string text = model.provenance.source + ": " + detail::text_of(model.size) + " pixels, " +
                       detail::counted(model.planes, "plane") + " of " + types_text(model.provenance);
    text += spaces_text(model.space, model.plane_spaces);
    text += "\n" + names_text(model.names) + maps_text(model.provenance.maps) + "compound, " +
            detail::counted(model.regions.size(), "region") + ", " + std::string(name(model.borders)) +
            " borders; labels explain " + number_text(100.0 * model.explained) + " % of the variance\n";
    for (const std::string& reason : model.provenance.reasons) text += reason + "\n";
    std::vector<std::vector<std::string>> rows{
        {"region", "share %", "pixels", "model", "levels", "contrast", "certificate", colour_heading(model)}};
    for (std::size_t k = 0; k < model.regions.size(); ++k) {
        const CompoundRegion& region = model.regions[k];
        rows.push_back({std::to_string(k), number_text(100.0 * region.share), std::to_string(region.pixels),
                        std::string(name(region.residual.kind)),
                        std::to_string(region.residual.levels.size()), number_text(region.contrast),
                        valid_text(region.residual), colour_text(region.colour)});
    }
    text += table(rows, "rrrlrrll");
    text += "control field of " + detail::text_of(model.control.size) +
            (model.periodic ? ", a tile" : ", the picture's") + "\n" +
            std::to_string(parameter_count(model)) + " parameters and the control field in " +
            std::to_string(bytes) + " bytes";
    if (model.provenance.picture_bytes > 0)
        text += ", compression ratio " + number_text(compression_ratio(model.provenance, bytes)) +
                " against " + std::to_string(model.provenance.picture_bytes) + " bytes of pixels";
    return text + "\n";
}

std::string uncertified_regions(const CompoundModel& model) {
    std::string text;
    for (std::size_t k = 0; k < model.regions.size(); ++k) {
        const std::string levels = uncertified_levels(model.regions[k].residual);
        if (!levels.empty())
            text += (text.empty() ? "region " : ", region ") + std::to_string(k) + " " + levels;
    }
    return text;
}

}  // namespace btfield::cli
