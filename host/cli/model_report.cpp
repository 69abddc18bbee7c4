#include "host/cli/model_report.hpp"

#include <cstddef>
#include <limits>
#include <system_error>
#include <vector>

#include "btfield/fit.hpp"
#include "host/base/text.hpp"
#include "host/spectrum/certificate_text.hpp"

namespace btfield::cli {
namespace {

Json level_json(const LevelModel& level) {
    const LinearField& field = linear_field(level.models.front());
    Json object;
    object["size"] = size_json(level.size);
    object["offsets"] = field.offsets.size();
    object["neighbourhood"] = name(field.kind);
    object["estimator"] = name(level.estimator);
    object["gain"] = number(level.gain);
    object["certificate"] = certificate_json(level.certificate);
    object["log_likelihood"] = number(level.log_likelihood);
    object["iterations"] = level.iterations;
    return object;
}

std::string ratios_text(const std::vector<double>& ratios) {
    constexpr std::size_t most = 6;  // spectral pictures have dozens of planes
    std::string text;
    for (std::size_t i = 0; i < ratios.size() && i < most; ++i)
        text += (i > 0 ? " " : "") + number_text(ratios[i]);
    return ratios.size() > most ? text + " ..." : text;
}

}  // namespace

std::uintmax_t model_file_bytes(const std::filesystem::path& path) {
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(path, error);
    return error ? 0 : bytes;
}

Json certificate_json(const Certificate& certificate) {
    Json ratios = Json::array();
    for (const double ratio : certificate.variance_ratio) ratios.push_back(number(ratio));
    Json object;
    object["valid"] = certificate.valid;
    object["min_singular"] = number(certificate.min_singular);
    object["variance_ratio"] = std::move(ratios);
    object["zeros"] = certificate.zeros;
    return object;
}

std::string spaces_text(ColourSpace space, const std::vector<ColourSpace>& of_planes) {
    if (space != ColourSpace::unspecified) return ", " + std::string(name(space));
    if (of_planes.size() == 1) return ", " + std::string(name(of_planes.front())) + " grey";
    std::string text;
    for (const ColourSpace each : {ColourSpace::srgb, ColourSpace::linear, ColourSpace::xyz}) {
        std::string planes;
        for (std::size_t p = 0; p < of_planes.size(); ++p)
            if (of_planes[p] == each) planes += (planes.empty() ? "" : ", ") + std::to_string(p);
        if (!planes.empty()) text += ", " + std::string(name(each)) + " in planes " + planes;
    }
    return text;
}

std::string names_text(const std::vector<std::string>& names) {
    if (names.empty()) return {};
    constexpr std::size_t most = 24;  // spectral pictures have dozens
    std::string text = "planes ";
    for (std::size_t i = 0; i < names.size() && i < most; ++i) text += (i > 0 ? ", " : "") + names[i];
    return text + (names.size() > most ? ", ...\n" : "\n");
}

Json maps_json(const std::vector<MaterialMap>& maps) {
    Json all = Json::array();
    for (const MaterialMap& map : maps) {
        Json object;
        object["name"] = map.name;
        object["role"] = name(map.role);
        object["planes"] = map.planes;
        object["type"] = name(map.type);
        if (map.scale > 0.0) object["scale"] = map.scale;
        all.push_back(std::move(object));
    }
    return all;
}

std::string maps_text(const std::vector<MaterialMap>& maps) {
    std::string text;
    for (const MaterialMap& map : maps)
        text += (text.empty() ? "maps " : ", ") + std::string(name(map.role)) + " " + map.name;
    return text.empty() ? text : text + "\n";
}

std::string types_text(const Provenance& provenance) {
    std::string text(name(provenance.type));
    for (const MaterialMap& map : provenance.maps)
        if (map.type != provenance.type) text += ", " + std::string(name(map.type)) + " of " + map.name;
    return text;
}

double compression_ratio(const Provenance& provenance, std::uintmax_t bytes) {
    if (provenance.picture_bytes == 0) return std::numeric_limits<double>::quiet_NaN();
    return static_cast<double>(provenance.picture_bytes) / static_cast<double>(bytes);
}

Json model_json(const TextureModel& model, const std::filesystem::path& path, std::uintmax_t bytes) {
    Json levels = Json::array();
    for (const LevelModel& level : model.levels) levels.push_back(level_json(level));
    Json object;
    object["model"] = name(model.kind);
    object["output"] = path.string();
    object["source"] = model.provenance.source;
    object["planes"] = model.planes;
    object["size"] = size_json(model.size);
    object["colour_space"] = name(model.space);
    if (!model.names.empty()) object["names"] = model.names;
    for (const ColourSpace space : model.plane_spaces) object["plane_colour_spaces"].push_back(name(space));
    if (!model.provenance.maps.empty()) object["maps"] = maps_json(model.provenance.maps);
    object["factor"] = model.factor;
    object["noise"] = name(model.noise);
    object["marginals"] = name(model.marginals.empty() ? MarginalMode::none : MarginalMode::match);
    object["valid"] = is_valid(model);
    object["levels"] = std::move(levels);
    if (!model.provenance.reasons.empty()) object["reasons"] = model.provenance.reasons;
    object["parameters"] = parameter_count(model);
    object["bytes"] = bytes;
    object["compression_ratio"] = number(compression_ratio(model.provenance, bytes));
    return object;
}

std::string model_text(const TextureModel& model, std::uintmax_t bytes) {
    std::string text = model.provenance.source + ": " + detail::text_of(model.size) + " pixels, " +
                       detail::counted(model.planes, "plane") + " of " + types_text(model.provenance);
    text += spaces_text(model.space, model.plane_spaces);
    text += "\n" + names_text(model.names) + maps_text(model.provenance.maps) +
            std::string(name(model.kind)) + ", " + std::to_string(model.levels.size()) +
            (model.levels.size() == 1 ? " level" : " levels by factor " + std::to_string(model.factor)) +
            ", " + std::string(name(model.noise)) + " noise covariance" +
            (model.marginals.empty() ? "" : ", marginals of the picture") + "\n";
    for (const std::string& reason : model.provenance.reasons) text += reason + "\n";

    std::vector<std::vector<std::string>> rows{{"level", "size", "offsets", "neighbourhood", "estimator",
                                                "gain", "certificate", "min singular", "zeros",
                                                "log-likelihood", "model/data variance"}};
    for (std::size_t k = 0; k < model.levels.size(); ++k) {
        const LevelModel& level = model.levels[k];
        const LinearField& field = linear_field(level.models.front());
        rows.push_back({std::to_string(k), detail::text_of(level.size), std::to_string(field.offsets.size()),
                        std::string(name(field.kind)), std::string(name(level.estimator)),
                        number_text(level.gain), level.certificate.valid ? "valid" : "FAILS",
                        number_text(level.certificate.min_singular), std::to_string(level.certificate.zeros),
                        number_text(level.log_likelihood), ratios_text(level.certificate.variance_ratio)});
    }
    text += table(rows, "rrrllrlrrrl");
    text += std::to_string(parameter_count(model)) + " parameters in " + std::to_string(bytes) + " bytes";
    if (model.provenance.picture_bytes > 0) {
        text += ", compression ratio " + number_text(compression_ratio(model.provenance, bytes)) +
                " against " + std::to_string(model.provenance.picture_bytes) + " bytes of pixels";
    }
    return text + "\n";
}

std::string uncertified_levels(const TextureModel& model) {
    std::string text;
    for (std::size_t k = 0; k < model.levels.size(); ++k) {
        const Certificate& certificate = model.levels[k].certificate;
        if (certificate.valid) continue;
        text += (text.empty() ? "level " : ", level ") + std::to_string(k) + " (" +
                detail::failure_text(certificate) + ")";
    }
    return text;
}

}  // namespace btfield::cli
