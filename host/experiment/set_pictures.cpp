#include "host/experiment/set_pictures.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <utility>

#include "btfield/btf_model.hpp"
#include "btfield/error.hpp"
#include "host/base/names.hpp"
#include "host/base/text.hpp"
#include "host/btf/btf_names.hpp"
#include "host/experiment/angles.hpp"
#include "host/experiment/sha256.hpp"
#include "host/pictures/picture_names.hpp"

namespace btfield::detail {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Names of pictures state whole, half or tenth degrees.
constexpr double farthest = 0.1;  // degrees

int nearest(const std::vector<BtfDirection>& all, const BtfDirection& direction) {
    int best = 0;
    for (std::size_t i = 1; i < all.size(); ++i)
        if (angle_between(all[i], direction) < angle_between(all[static_cast<std::size_t>(best)], direction))
            best = static_cast<int>(i);
    return best;
}

int place_of(const std::vector<BtfDirection>& all, const BtfDirection& direction, const std::string& what,
             const std::string& asked) {
    const int place = nearest(all, direction);
    const BtfDirection& found = all[static_cast<std::size_t>(place)];
    if (in_degrees(angle_between(found, direction)) <= farthest) return place;
    throw InputError(asked, "it has no " + what + " " + angles_text(direction),
                     "the nearest is " + angles_text(found) + "; 'btfield btf info' describes the set");
}

/// \throws InputError when the set has no such view, light or picture
BtfPair pair_of(const BtfSet& set, const ExperimentDirections& at, const std::string& asked) {
    const BtfPair pair{place_of(set.views(), at.view, "view", asked),
                       place_of(set.lights(), at.light, "light", asked)};
    if (!set.has(pair.view, pair.light))
        throw InputError(asked, "it has no picture of " + directions_text(at), "choose one that it has");
    return pair;
}

/// Indices ring by ring.
std::vector<int> by_ring(const std::vector<BtfDirection>& directions) {
    std::vector<int> order(directions.size());
    std::iota(order.begin(), order.end(), 0);
    std::ranges::stable_sort(order, {}, [&](int i) {
        const BtfDirection at = within_a_turn(directions[static_cast<std::size_t>(i)]);
        return std::pair(at.theta, at.phi);
    });
    return order;
}

/// In [0, 1), another for every state (Steele, Lea and Flood 2014).
double share_of(std::uint64_t state) {
    state *= 0x9e3779b97f4a7c15U;
    state = (state ^ (state >> 30U)) * 0xbf58476d1ce4e5b9U;
    state = (state ^ (state >> 27U)) * 0x94d049bb133111ebU;
    return std::ldexp(static_cast<double>((state ^ (state >> 31U)) >> 11U), -53);
}

/// The digits of a number in reverse order behind the point: of bases 2 and 3, Halton's sequence.
double radical_inverse(std::uint64_t number, std::uint64_t base) {
    double sum = 0.0, unit = 1.0;
    for (; number > 0; number /= base) {
        unit /= static_cast<double>(base);
        sum += unit * static_cast<double>(number % base);
    }
    return sum;
}

std::vector<BtfPair> chosen_pairs(const BtfSet& set, const ExperimentBtf& which, const std::string& asked) {
    if (which.named.empty()) {
        std::vector<BtfPair> all = set.pictures();
        if (which.number <= 0) return all;
        if (static_cast<std::size_t>(which.number) <= all.size())
            return sampled_pairs(set, which.number, which.seed);
        throw InputError(asked,
                         "it has " + std::to_string(all.size()) + " pictures, and " +
                             std::to_string(which.number) + " are asked for",
                         "ask for fewer, or for \"all\"");
    }
    std::vector<BtfPair> pairs;
    for (const ExperimentDirections& at : which.named) pairs.push_back(pair_of(set, at, asked));
    return pairs;
}

bool compares_btfs(const ExperimentConfig& config) {
    return std::ranges::find(config.models, ExperimentModel::btf) != config.models.end();
}

void check_model(const BtfModel& model, const BtfSet& set, const std::string& asked) {
    if (model.colours == set.planes()) return;
    throw InputError(asked,
                     "its model has " + counted(model.colours, "colour") + ", its pictures have " +
                         counted(set.planes(), "plane"),
                     "name the model that was fitted to this set");
}

}  // namespace

void check_models_of_btfs(const ExperimentConfig& config) {
    if (!compares_btfs(config)) return;
    for (const ExperimentPictures& entry : config.pictures)
        if (!entry.btf || entry.btf->model.empty())
            throw InputError("experiment with the model 'btf'",
                             "the pictures of " + entry.material + " have none",
                             "correct the configuration: give them a 'btf' and its 'btf_model', or leave the "
                             "model out; nothing was run");
}

std::string btf_models_content(const ExperimentConfig& config) {
    std::string contents;
    for (const ExperimentPictures& entry : config.pictures)
        if (entry.btf && !entry.btf->model.empty())
            contents += sha256_of_file(config.folder / entry.btf->model) + "\n";
    return sha256(contents);
}

BtfSet OpenSets::open(const fs::path& path, const BtfOptions& options) {
    const std::string key = path.string() + "\n" + crop_text(options.crop) + "\n" + reading_text(options);
    const std::lock_guard lock(mutex_);
    const auto found = sets_.find(key);
    if (found != sets_.end()) return found->second;
    return sets_.emplace(key, BtfSet::open(path, options)).first->second;
}

std::vector<BtfPair> sampled_pairs(const BtfSet& set, int number, std::uint64_t seed) {
    const std::vector<int> views = by_ring(set.views()), lights = by_ring(set.lights());
    const std::size_t columns = lights.size(), all = views.size() * columns;
    const double view_shift = share_of(2 * seed + 1), light_shift = share_of(2 * seed + 2);
    const auto place = [](double share, std::size_t count) {
        const auto at = static_cast<std::size_t>((share - std::floor(share)) * static_cast<double>(count));
        return std::min(at, count - 1);
    };
    std::vector<bool> taken(all, false);
    const auto free = [&](std::size_t cell) {
        return !taken[cell] && set.has(views[cell / columns], lights[cell % columns]);
    };
    std::vector<BtfPair> pairs;
    const std::size_t most = std::min(static_cast<std::size_t>(std::max(number, 0)), set.pictures().size());
    for (std::uint64_t i = 0; pairs.size() < most; ++i) {
        std::size_t cell = place(view_shift + radical_inverse(i, 2), views.size()) * columns +
                           place(light_shift + radical_inverse(i, 3), columns);
        while (!free(cell)) cell = (cell + 1) % all;
        taken[cell] = true;
        pairs.push_back({views[cell / columns], lights[cell % columns]});
    }
    std::ranges::sort(pairs, {}, [](const BtfPair& pair) { return std::pair(pair.view, pair.light); });
    return pairs;
}

std::vector<PictureSource> set_pictures(const ExperimentPictures& entry, const ExperimentConfig& config,
                                        OpenSets& sets) {
    const ExperimentBtf& which = *entry.btf;
    const std::string asked = "experiment with the BTF '" + which.set + "' of " + entry.material;
    std::string set_name = fs::path(which.set).lexically_normal().string();
    while (set_name.size() > 1 && set_name.back() == '/') set_name.pop_back();
    const fs::path file = config.folder / set_name;
    BtfOptions options = which.reading;
    options.crop = entry.crop;
    try {
        const BtfSet set = sets.open(file, options);
        fs::path model;
        std::string model_content;
        if (compares_btfs(config)) {
            model = config.folder / which.model;
            model_content = sha256_of_file(model);
            check_model(read_btf_model(model), set, asked);
        }
        std::vector<PictureSource> sources;
        for (const BtfPair& pair : chosen_pairs(set, which, asked)) {
            PictureSource source;
            source.file = file;
            source.material = entry.material;
            source.crop = entry.crop;
            source.white = entry.white.value_or(set.white());
            const ExperimentDirections at{set.views()[static_cast<std::size_t>(pair.view)],
                                          set.lights()[static_cast<std::size_t>(pair.light)]};
            source.direction = DirectionSource{set_name, which.reading, at, set.light(pair.view, pair.light),
                                               model,    model_content};
            source.name = set_name + " " + directions_text(at);
            if (which.reading.pixel_stride > 1)
                source.name += " stride " + std::to_string(which.reading.pixel_stride);
            sources.push_back(std::move(source));
        }
        return sources;
    } catch (const InputError& error) {
        throw InputError(asked, error.found(),
                         "correct the configuration: " + error.remedy() + "; nothing was run");
    }
}

namespace {

/// A set that is open, and a picture of it.
std::pair<BtfSet, BtfPair> opened_pair(OpenSets& sets, const fs::path& file, const DirectionSource& direction,
                                       const std::optional<Crop>& crop) {
    BtfOptions options = direction.reading;
    options.crop = crop;
    BtfSet set = sets.open(file, options);
    const BtfPair pair = pair_of(set, direction.at, "read a picture of the BTF '" + file.string() + "'");
    return {std::move(set), pair};
}

}  // namespace

Image read_direction(OpenSets& sets, const fs::path& file, const DirectionSource& direction,
                     const std::optional<Crop>& crop) {
    const auto [set, pair] = opened_pair(sets, file, direction, crop);
    return set.picture(pair.view, pair.light);
}

std::string stamp_of_direction(OpenSets& sets, const fs::path& file, const DirectionSource& direction,
                               const std::optional<Crop>& crop) {
    const auto [set, pair] = opened_pair(sets, file, direction, crop);
    return set.stamp(pair.view, pair.light);
}

std::string sha256_of_values(const Image& image) {
    Sha256 hash;
    hash.add(std::to_string(image.height()) + " " + std::to_string(image.width()) + " " +
             std::to_string(image.planes()) + "\n");
    static_assert(std::endian::native == std::endian::little);
    const std::span<const float> values = image.values();
    hash.add({reinterpret_cast<const char*>(values.data()), values.size_bytes()});
    return hash.digest();
}

std::string directions_text(const ExperimentDirections& at) {
    return "view " + angles_text(at.view) + " light " + angles_text(at.light);
}

std::string reading_text(const BtfOptions& reading) {
    json object;
    object["coding"] = word_of(reading.coding);
    if (reading.space) object["colour"] = word_of(*reading.space);
    object["pixel_stride"] = reading.pixel_stride;
    object["view_stride"] = reading.view_stride;
    object["light_stride"] = reading.light_stride;
    return object.dump();
}

BtfOptions reading_of(std::string_view text) {
    try {
        const json object = json::parse(text);
        BtfOptions reading;
        reading.coding = value_of<BtfCoding>(object.at("coding").get<std::string>());
        if (object.contains("colour"))
            reading.space = value_of<ColourSpace>(object["colour"].get<std::string>());
        reading.pixel_stride = object.at("pixel_stride").get<int>();
        reading.view_stride = object.at("view_stride").get<int>();
        reading.light_stride = object.at("light_stride").get<int>();
        return reading;
    } catch (const json::exception&) {
        throw InputError("read how a BTF of an experiment was read", "'" + std::string(text) + "' is damaged",
                         "use a database that btfield wrote");
    }
}

}  // namespace btfield::detail
