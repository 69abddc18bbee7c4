#include "host/experiment/jobs.hpp"

#include <glob.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/base/parallel.hpp"
#include "host/experiment/experiment_names.hpp"
#include "host/experiment/sha256.hpp"

namespace btfield::detail {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// What the model has of its own, else what all have.
template <class Value>
const Value& setting_of(const ExperimentConfig& config, ExperimentModel model,
                        std::optional<Value> ExperimentModelSettings::*own, const Value& everywhere) {
    const auto found = config.own.find(model);
    return found != config.own.end() && found->second.*own ? *(found->second.*own) : everywhere;
}

/// Those of all models, in the order in which they are named.
std::vector<MarginalMode> all_marginals(const ExperimentConfig& config) {
    std::vector<MarginalMode> all = config.marginals;
    for (const auto& entry : config.own) {
        for (const MarginalMode mode : entry.second.marginals.value_or(std::vector<MarginalMode>{}))
            if (std::ranges::find(all, mode) == all.end()) all.push_back(mode);
    }
    return all;
}

[[noreturn]] void fail(const std::string& pattern, const std::string& found, const std::string& remedy) {
    throw InputError("find the pictures '" + pattern + "'", found, remedy);
}

std::vector<fs::path> matches(const fs::path& folder, const std::string& pattern) {
    // The folder is no pattern, whatever characters it holds.
    std::string full;
    if (!fs::path(pattern).is_absolute()) {
        for (const char c : folder.string()) {
            if (std::string_view("*?[]\\").find(c) != std::string_view::npos) full += '\\';
            full += c;
        }
        full += "/";
    }
    full += pattern;
    glob_t found{};
    const int code = ::glob(full.c_str(), GLOB_ERR, nullptr, &found);
    std::vector<fs::path> files;
    for (std::size_t i = 0; code == 0 && i < found.gl_pathc; ++i) files.emplace_back(found.gl_pathv[i]);
    ::globfree(&found);
    if (code == GLOB_NOMATCH) {
        fail(pattern, "there is none in '" + folder.string() + "'",
             "correct the pattern, which is relative to the configuration's folder");
    }
    if (code != 0) fail(pattern, "a folder cannot be read", "make it readable or correct the pattern");
    std::sort(files.begin(), files.end());
    return files;
}

}  // namespace

bool has_one_estimator(ExperimentModel model) {
    const std::optional<ModelKind> field = random_field(model);
    return !field || family(*field) == Family::car || family(*field) == Family::ma;
}

NoiseForm noise_of(const ExperimentConfig& config, ExperimentModel model) {
    return setting_of(config, model, &ExperimentModelSettings::noise, config.noise);
}

GainMode gains_of(const ExperimentConfig& config, ExperimentModel model) {
    return setting_of(config, model, &ExperimentModelSettings::gains, config.gains);
}

bool same_fit(const JobSettings& a, const JobSettings& b) {
    JobSettings twin = b;
    twin.seed = a.seed;
    return a == twin;
}

std::string_view marginals_text(const JobSettings& settings) {
    return settings.model == ExperimentModel::roll ? any_marginals : name(settings.marginals);
}

std::string_view name(JobStatus status) {
    return word_of(status);
}

JobStatus job_status(std::string_view text) {
    if (const auto status = find_value<JobStatus>(text)) return *status;
    throw InputError("read the status of a job", "'" + std::string(text) + "' is none",
                     "use a database that btfield wrote");
}

std::vector<JobSettings> job_settings(const ExperimentConfig& config) {
    std::vector<int> orders = config.orders;
    std::sort(orders.rbegin(), orders.rend());
    std::vector<JobSettings> all;
    using Settings = ExperimentModelSettings;
    for (const MarginalMode marginals : all_marginals(config)) {
        for (const int order : orders) {
            for (const int levels : config.levels) {
                for (const ExperimentModel model : config.models) {
                    if (model == ExperimentModel::roll) continue;
                    const auto& modes = setting_of(config, model, &Settings::marginals, config.marginals);
                    if (std::ranges::find(modes, marginals) == modes.end()) continue;
                    std::vector<EstimatorChoice> estimators =
                        setting_of(config, model, &Settings::estimators, config.estimators);
                    if (has_one_estimator(model)) estimators = {EstimatorChoice::automatic};
                    for (const EstimatorChoice estimator : estimators) {
                        for (const std::uint64_t seed : config.seeds) {
                            all.push_back({model, order, levels, estimator, marginals, seed});
                        }
                    }
                }
            }
        }
    }
    if (std::ranges::find(config.models, ExperimentModel::roll) != config.models.end()) {
        for (const std::uint64_t seed : config.seeds)
            all.push_back(
                {ExperimentModel::roll, 0, 0, EstimatorChoice::automatic, MarginalMode::match, seed});
    }
    return all;
}

std::string settings_text(const ExperimentConfig& config, const JobSettings& settings) {
    json object;  // keeps its keys sorted
    object["model"] = name(settings.model);
    object["seed"] = settings.seed;
    object["metric"] = name(config.metric);
    object["size"] = config.size ? json::array({config.size->width, config.size->height}) : json(nullptr);
    // Named where it is not as it ever was: keys of older databases stay.
    if (config.values != MeasuredValues::stored) object["values"] = word_of(config.values);
    if (settings.model == ExperimentModel::roll) return object.dump();
    object["order"] = settings.order;
    object["levels"] = settings.levels;
    object["estimator"] = name(settings.estimator);
    object["marginals"] = name(settings.marginals);
    object["factor"] = config.factor;
    object["noise"] = name(noise_of(config, settings.model));
    object["allow_invalid"] = config.allow_invalid;
    if (settings.model == ExperimentModel::compound) return object.dump();
    object["gains"] = name(gains_of(config, settings.model));
    return object.dump();
}

std::string job_key(const std::string& picture, const std::string& settings) {
    return sha256(picture + "\n" + settings);
}

std::string crop_text(const std::optional<Crop>& crop) {
    if (!crop) return {};
    return std::to_string(crop->x) + "," + std::to_string(crop->y) + "," + std::to_string(crop->width) + "," +
           std::to_string(crop->height);
}

std::string picture_identity(const std::string& content, const std::optional<Crop>& crop, double white) {
    return sha256(content + "\n" + crop_text(crop) + "\n" + json(white).dump());
}

std::vector<PictureSource> picture_sources(const ExperimentConfig& config) {
    std::vector<PictureSource> sources;
    std::set<std::pair<std::string, std::string>> seen;
    for (const ExperimentPictures& entry : config.pictures) {
        for (const std::string& pattern : entry.files) {
            for (const fs::path& file : matches(config.folder, pattern)) {
                PictureSource source;
                source.file = file;
                source.name = fs::path(pattern).is_absolute()
                                  ? file.string()
                                  : file.lexically_relative(config.folder).string();
                source.material = entry.material;
                source.crop = entry.crop;
                source.white = entry.white;
                if (!seen.emplace(source.name, crop_text(source.crop)).second) {
                    fail(pattern, "'" + source.name + "' is named twice", "name every picture once");
                }
                sources.push_back(std::move(source));
            }
        }
    }
    for_each_block(static_cast<int>(sources.size()), [&](int i) {
        PictureSource& source = sources[static_cast<std::size_t>(i)];
        source.content = sha256_of_file(source.file);
        source.picture = picture_identity(source.content, source.crop, source.white);
    });
    return sources;
}

void check_pictures(const std::vector<PictureSource>& sources,
                    const std::function<bool(const std::string& picture)>& known) {
    std::vector<const PictureSource*> unread;
    std::set<std::string> seen;
    for (const PictureSource& source : sources)
        if (seen.insert(source.picture).second && !known(source.picture)) unread.push_back(&source);
    std::vector<std::optional<InputError>> errors(unread.size());
    for_each_block(static_cast<int>(unread.size()), [&](int i) {
        const auto at = static_cast<std::size_t>(i);
        try {
            static_cast<void>(read_picture(unread[at]->file, unread[at]->crop));
        } catch (const InputError& error) {
            errors[at] = error;
        }
    });
    const auto bad = std::ranges::find_if(errors, [](const auto& error) { return error.has_value(); });
    if (bad == errors.end()) return;
    const PictureSource& source = *unread[static_cast<std::size_t>(bad - errors.begin())];
    const auto others =
        std::count_if(bad + 1, errors.end(), [](const auto& error) { return error.has_value(); });
    const std::string crop = source.crop ? ", crop [" + crop_text(source.crop) + "]" : "";
    const std::string more = others == 0   ? ""
                             : others == 1 ? " (and another picture fails)"
                                           : " (and " + std::to_string(others) + " other pictures fail)";
    throw InputError("experiment with '" + source.name + "' of " + source.material + crop,
                     (*bad)->found() + more,
                     "correct the configuration: " + (*bad)->remedy() + "; nothing was run");
}

}  // namespace btfield::detail
