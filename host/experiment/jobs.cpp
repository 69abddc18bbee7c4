#include "host/experiment/jobs.hpp"

#include <glob.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "btfield/neighbourhood.hpp"
#include "btfield/pyramid.hpp"
#include "host/base/parallel.hpp"
#include "host/base/text.hpp"
#include "host/experiment/experiment_names.hpp"
#include "host/experiment/set_pictures.hpp"
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

bool has_levels(ExperimentModel model) {
    return model != ExperimentModel::roll && model != ExperimentModel::btf;
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
    return has_levels(settings.model) ? name(settings.marginals) : any_marginals;
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
                    if (!has_levels(model)) continue;
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
    for (const ExperimentModel model : config.models) {
        if (has_levels(model)) continue;
        const std::string content =
            model == ExperimentModel::btf ? btf_models_content(config) : std::string();
        for (const std::uint64_t seed : config.seeds)
            all.push_back({model, 0, 0, EstimatorChoice::automatic, MarginalMode::match, seed, content});
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
    if (settings.model == ExperimentModel::btf) {
        object["allow_invalid"] = config.allow_invalid;
        object["btf_models"] = settings.btf_models;
        return object.dump();
    }
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

namespace {

std::vector<PictureSource> matching_files(const ExperimentPictures& entry, const fs::path& folder,
                                          const std::string& pattern) {
    std::vector<PictureSource> sources;
    for (const fs::path& file : matches(folder, pattern)) {
        PictureSource& source = sources.emplace_back();
        source.file = file;
        source.name =
            fs::path(pattern).is_absolute() ? file.string() : file.lexically_relative(folder).string();
        source.material = entry.material;
        source.crop = entry.crop;
        source.white = entry.white.value_or(1.0);
    }
    return sources;
}

std::string asked_of(const PictureSource& source) {
    const std::string crop = source.crop ? ", crop [" + crop_text(source.crop) + "]" : "";
    return "experiment with '" + source.name + "' of " + source.material + crop;
}

std::string place_of(const PictureSource& source) {
    std::error_code error;
    const fs::path file = fs::absolute(source.file, error);
    return (error ? source.file : file).string() + "\n" + crop_text(source.crop) + "\n" +
           reading_text(source.direction->reading) + "\n" + directions_text(source.direction->at);
}

/// \return whether it is known
bool is_known(PictureSource& source, const std::string& stamp, const KnownPictures& known) {
    if (stamp.empty()) return false;
    const auto found = known.find(place_of(source));
    if (found == known.end() || found->second.stamp != stamp) return false;
    source.content = found->second.content;
    source.shape = found->second.shape;
    source.picture = picture_identity(source.content, source.crop, source.white);
    return true;
}

/// Names the contents of a source; reads a picture of a BTF for that.
void identify(PictureSource& source, OpenSets& sets) {
    if (!source.direction) {
        source.content = sha256_of_file(source.file);
    } else {
        try {
            const Image image = read_direction(sets, source.file, *source.direction, source.crop);
            source.content = sha256_of_values(image);
            source.shape = PictureShape{image.size(), image.planes()};
        } catch (const InputError& error) {
            throw InputError(asked_of(source), error.found(),
                             "correct the configuration: " + error.remedy() + "; nothing was run");
        }
    }
    source.picture = picture_identity(source.content, source.crop, source.white);
}

}  // namespace

std::vector<PictureSource> picture_sources(const ExperimentConfig& config, OpenSets& sets,
                                           KnownPictures* known) {
    check_models_of_btfs(config);
    std::vector<PictureSource> sources;
    std::set<std::pair<std::string, std::string>> seen;
    const auto add = [&](std::vector<PictureSource> found, const std::string& pattern) {
        for (PictureSource& source : found) {
            if (!seen.emplace(source.name, crop_text(source.crop)).second)
                fail(pattern, "'" + source.name + "' is named twice", "name every picture once");
            sources.push_back(std::move(source));
        }
    };
    for (const ExperimentPictures& entry : config.pictures) {
        for (const std::string& pattern : entry.files)
            add(matching_files(entry, config.folder, pattern), pattern);
        if (entry.btf) add(set_pictures(entry, config, sets), entry.btf->set);
    }
    std::vector<std::string> stamps(sources.size());
    for_each_block(static_cast<int>(sources.size()), [&](int i) {
        const auto at = static_cast<std::size_t>(i);
        PictureSource& source = sources[at];
        // Before it is read: what changes meanwhile is read again the next time.
        if (known != nullptr && source.direction)
            stamps[at] = stamp_of_direction(sets, source.file, *source.direction, source.crop);
        if (known == nullptr || !is_known(source, stamps[at], *known)) identify(source, sets);
    });
    for (std::size_t i = 0; i < sources.size(); ++i)
        if (!stamps[i].empty() && sources[i].shape)
            known->insert_or_assign(place_of(sources[i]),
                                    KnownPicture{stamps[i], sources[i].content, *sources[i].shape});
    return sources;
}

namespace {

[[noreturn]] void refuse_room(const PictureSource& source, Size size, const std::string& what, int least,
                              const std::string& remedy) {
    throw InputError(asked_of(source),
                     "its " + text_of(size) + " pixels have no room for " + what +
                         ": its coarsest level would be " + "smaller than the neighbourhood of order " +
                         std::to_string(least),
                     "correct the configuration: " + remedy + "; nothing was run");
}

/// Whether a level has room for the smallest neighbourhood of the order, that of causal models.
bool has_room(Size level, int order) {
    const std::vector<Offset> offsets = neighbourhood(order, NeighbourhoodKind::causal);
    const Offset box = difference_box(offsets);
    return level.height > box.row && level.width > box.column && area(level) > offsets.size();
}

/// 3D models have more equations the more planes there are.
void check_planes(const ExperimentConfig& config, const PictureSource& source, const PictureShape& shape,
                  Size coarsest, int order) {
    const auto field = std::ranges::find_if(config.models, [](ExperimentModel model) {
        const std::optional<ModelKind> kind = random_field(model);
        return kind && !is_2d(*kind);
    });
    if (field == config.models.end()) return;
    const std::size_t unknowns =
        neighbourhood(order, NeighbourhoodKind::causal).size() * static_cast<std::size_t>(shape.planes);
    if (area(coarsest) > unknowns) return;
    throw InputError(asked_of(source),
                     "its " + counted(shape.planes, "plane") + " are too many for " +
                         std::string(name(*field)) + ": even order " + std::to_string(order) + " has " +
                         std::to_string(unknowns) + " unknowns a plane, and the coarsest level " +
                         std::to_string(area(coarsest)) + " pixels",
                     "correct the configuration: use 2D models, larger pictures or fewer levels; nothing was "
                     "run");
}

constexpr int longest_side = 16384;  // of what spectra can be transformed and the roller cuts
constexpr int shortest_rolled = 16;  // of what the roller cuts

bool is_rolled(ExperimentModel model) {
    return model == ExperimentModel::compound || model == ExperimentModel::roll;
}

void check_texture_size(const ExperimentConfig& config) {
    if (!config.size) return;
    const std::string asked = "experiment with textures of " + text_of(*config.size);
    const auto rolled = std::ranges::find_if(config.models, is_rolled);
    if (rolled != config.models.end() && std::min(config.size->height, config.size->width) < shortest_rolled)
        throw InputError(
            asked,
            std::string(name(*rolled)) + " needs " + std::to_string(shortest_rolled) + " pixels on a side",
            "correct the configuration: give a larger 'size'; nothing was run");
    const bool fields = std::ranges::any_of(
        config.models, [](ExperimentModel model) { return random_field(model).has_value(); });
    const bool compound = std::ranges::find(config.models, ExperimentModel::compound) != config.models.end();
    if ((fields || compound) && std::max(config.size->height, config.size->width) > longest_side)
        throw InputError(asked,
                         std::string(fields ? "random fields grow" : "compound models grow") + " to " +
                             std::to_string(longest_side) + " pixels on a side",
                         "correct the configuration: give a smaller 'size'; nothing was run");
    // A plane of the texture, and one to measure it by.
    const double needed = 2.0 * sizeof(float) * static_cast<double>(area(*config.size));
    const double memory =
        static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE));
    if (memory > 0.0 && needed > memory)
        throw InputError(asked,
                         "one plane of them takes more than the " +
                             std::to_string(static_cast<long long>(memory / 1e9)) + " GB of this machine",
                         "correct the configuration: give a smaller 'size'; nothing was run");
}

void check_rolled(const ExperimentConfig& config, const std::vector<PictureSource>& sources,
                  const std::map<std::string, PictureShape>& shapes) {
    const auto rolled = std::ranges::find_if(config.models, is_rolled);
    if (rolled == config.models.end()) return;
    for (const PictureSource& source : sources) {
        const auto found = shapes.find(source.picture);
        if (found == shapes.end()) continue;
        const Size size = found->second.size;
        if (std::min(size.height, size.width) >= shortest_rolled &&
            std::max(size.height, size.width) <= longest_side)
            continue;
        throw InputError(asked_of(source),
                         std::string(name(*rolled)) + " needs sides from " + std::to_string(shortest_rolled) +
                             " to " + std::to_string(longest_side) + " pixels, and it has " + text_of(size),
                         "correct the configuration: leave it out, or do not ask for this model; nothing was "
                         "run");
    }
}

}  // namespace

void check_room(const ExperimentConfig& config, const std::vector<PictureSource>& sources,
                const std::map<std::string, PictureShape>& shapes) {
    check_texture_size(config);
    check_rolled(config, sources, shapes);
    const bool fields = std::ranges::any_of(
        config.models, [](ExperimentModel model) { return random_field(model).has_value(); });
    if (!fields) return;
    const int least_order = *std::ranges::min_element(config.orders);
    const int least_levels = std::max(1, *std::ranges::min_element(config.levels));
    for (const PictureSource& source : sources) {
        const auto found = shapes.find(source.picture);
        if (found == shapes.end()) continue;
        const PictureShape& shape = found->second;
        const auto coarsest = [&](int levels) {
            return pyramid_sizes(shape.size, levels, config.factor).back();
        };
        for (const int levels : config.levels) {
            if (levels < 1 || has_room(coarsest(levels), least_order)) continue;
            int most = levels;
            while (most > 1 && !has_room(coarsest(most), least_order)) --most;
            refuse_room(source, shape.size, counted(levels, "level"), least_order,
                        "use at most " + counted(most, "level"));
        }
        for (const int order : config.orders)
            if (!has_room(coarsest(least_levels), order))
                refuse_room(source, shape.size,
                            counted(least_levels, "level") + " of order " + std::to_string(order), order,
                            "use a lower order or fewer levels");
        check_planes(config, source, shape, coarsest(least_levels), least_order);
    }
}

std::map<std::string, PictureShape> check_pictures(
    const std::vector<PictureSource>& sources,
    const std::function<std::optional<PictureShape>(const std::string& picture)>& known) {
    std::vector<const PictureSource*> unread;
    std::map<std::string, PictureShape> shapes;
    for (const PictureSource& source : sources) {
        if (shapes.count(source.picture) != 0) continue;
        const std::optional<PictureShape> before = source.shape ? source.shape : known(source.picture);
        shapes[source.picture] = before.value_or(PictureShape{});
        if (!before) unread.push_back(&source);
    }
    std::vector<PictureShape> read(unread.size());
    std::vector<std::optional<InputError>> errors(unread.size());
    for_each_block(static_cast<int>(unread.size()), [&](int i) {
        const auto at = static_cast<std::size_t>(i);
        try {
            const Image image = read_picture(unread[at]->file, unread[at]->crop).image;
            read[at] = {image.size(), image.planes()};
        } catch (const InputError& error) {
            errors[at] = error;
        }
    });
    const auto bad = std::ranges::find_if(errors, [](const auto& error) { return error.has_value(); });
    if (bad == errors.end()) {
        for (std::size_t i = 0; i < unread.size(); ++i) shapes[unread[i]->picture] = read[i];
        return shapes;
    }
    const PictureSource& source = *unread[static_cast<std::size_t>(bad - errors.begin())];
    const auto others =
        std::count_if(bad + 1, errors.end(), [](const auto& error) { return error.has_value(); });
    const std::string more = others == 0   ? ""
                             : others == 1 ? " (and another picture fails)"
                                           : " (and " + std::to_string(others) + " other pictures fail)";
    throw InputError(asked_of(source), (*bad)->found() + more,
                     "correct the configuration: " + (*bad)->remedy() + "; nothing was run");
}

}  // namespace btfield::detail
