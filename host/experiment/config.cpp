#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "btfield/error.hpp"
#include "btfield/experiment.hpp"
#include "host/base/strict_json.hpp"
#include "host/btf/btf_names.hpp"
#include "host/criteria/metric_names.hpp"
#include "host/experiment/angles.hpp"
#include "host/experiment/config_text.hpp"
#include "host/experiment/experiment_names.hpp"
#include "host/experiment/jobs.hpp"
#include "host/fit/fit_names.hpp"
#include "host/pictures/picture_names.hpp"

namespace btfield {

using namespace detail;

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// A value of the configuration that knows where it stands.
class Entry {
  public:
    Entry(const json& value, std::string place, const std::string& asked)
        : value_(value), place_(std::move(place)), asked_(asked) {}

    [[noreturn]] void fail(const std::string& found) const {
        throw InputError(asked_, place_.empty() ? found : place_ + " " + found,
                         "see docs/experiments.md for what a configuration holds");
    }
    [[nodiscard]] bool holds(const char* key) const { return value_.contains(key); }
    [[nodiscard]] Entry operator[](const char* key) const {
        if (!holds(key)) fail("lacks the key '" + std::string(key) + "'");
        return {value_[key], place_.empty() ? std::string(key) : place_ + "." + key, asked_};
    }
    void check_keys(std::initializer_list<const char*> known) const {
        if (!value_.is_object()) fail("is no object");
        for (const auto& item : value_.items()) {
            if (std::find(known.begin(), known.end(), item.key()) != known.end()) continue;
            std::string list;
            for (const char* key : known) list += (list.empty() ? "" : ", ") + std::string(key);
            fail("has the unknown key '" + printable(item.key()) + "' (known: " + list + ")");
        }
    }
    [[nodiscard]] bool is_object() const { return value_.is_object(); }
    [[nodiscard]] bool is_list() const { return value_.is_array(); }
    [[nodiscard]] std::vector<std::string> keys() const {
        std::vector<std::string> keys;
        for (const auto& item : value_.items()) keys.push_back(item.key());
        return keys;
    }
    [[nodiscard]] std::vector<Entry> items() const {
        if (!value_.is_array() || value_.empty()) fail("is no list with at least one entry");
        std::vector<Entry> entries;
        for (std::size_t i = 0; i < value_.size(); ++i) {
            entries.emplace_back(value_[i], place_ + "[" + std::to_string(i) + "]", asked_);
        }
        return entries;
    }
    [[nodiscard]] std::string text() const {
        if (!value_.is_string() || value_.get_ref<const std::string&>().empty()) fail("is no text");
        return value_.get<std::string>();
    }
    [[nodiscard]] bool is_text(std::string_view word) const {
        return value_.is_string() && value_.get_ref<const std::string&>() == word;
    }
    [[nodiscard]] bool flag() const {
        if (!value_.is_boolean()) fail("is neither true nor false");
        return value_.get<bool>();
    }
    [[nodiscard]] std::uint64_t whole(std::uint64_t lowest, std::uint64_t highest) const {
        if (!value_.is_number_unsigned() || value_.get<std::uint64_t>() < lowest ||
            value_.get<std::uint64_t>() > highest) {
            fail("is " + printable(value_.dump()) + ", not a whole number from " + std::to_string(lowest) +
                 " to " + std::to_string(highest));
        }
        return value_.get<std::uint64_t>();
    }
    [[nodiscard]] int integer(int lowest, int highest) const {
        return static_cast<int>(
            whole(static_cast<std::uint64_t>(lowest), static_cast<std::uint64_t>(highest)));
    }
    [[nodiscard]] double positive() const {
        if (!value_.is_number() || !(value_.get<double>() > 0.0) || !std::isfinite(value_.get<double>())) {
            fail("is no number above 0");
        }
        return value_.get<double>();
    }
    [[nodiscard]] double number() const {
        if (!value_.is_number() || !std::isfinite(value_.get<double>())) fail("is no number");
        return value_.get<double>();
    }
    /// A value by its word.
    template <class Value>
    [[nodiscard]] Value one_of() const {
        for (const auto& [value, word] : names_of<Value>()) {
            if (is_text(word)) return value;
        }
        fail("is " + printable(value_.dump()) + ", none of " + words_of<Value>());
    }
    /// A list without repetitions.
    template <class Read>
    [[nodiscard]] auto list(const Read& read) const {
        std::vector<decltype(read(*this))> values;
        for (const Entry& entry : items()) {
            const auto value = read(entry);
            if (std::find(values.begin(), values.end(), value) != values.end()) {
                entry.fail("repeats an earlier entry");
            }
            values.push_back(value);
        }
        return values;
    }

  private:
    const json& value_;
    std::string place_;
    const std::string& asked_;
};

std::string bytes_of(const fs::path& path, const std::string& asked) {
    std::error_code error;
    if (!fs::is_regular_file(path, error)) {
        throw InputError(asked, fs::exists(path, error) ? "it is no file" : "there is no such file",
                         "give the path of an experiment's configuration");
    }
    std::ifstream file(path, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    if (!file) throw InputError(asked, "it cannot be read", "make it readable");
    return bytes;
}

json parsed(const std::string& text, const std::string& asked) {
    try {
        return parse_strictly(text, asked);
    } catch (const InputError& error) {
        throw InputError(asked, error.found(), "write the configuration as docs/experiments.md describes it");
    }
}

/// A value for all models, or one by model or family: {"default": …, "car": …, "3d-msar": …}. A model's own
/// goes before its family's, that before the default.
/// \param everywhere gets what holds for all
/// \param own where a model keeps its own
template <class Value, class Read>
void read_by_model(const Entry& entry, Value& everywhere,
                   std::map<ExperimentModel, ExperimentModelSettings>& models,
                   std::optional<Value> ExperimentModelSettings::*own, bool compound, const Read& read) {
    if (!entry.is_object()) {
        everywhere = read(entry);
        return;
    }
    if (entry.keys().empty()) entry.fail("is an empty object");
    std::map<ExperimentModel, Value> single, families;
    for (const std::string& key : entry.keys()) {
        const Value value = read(entry[key.c_str()]);
        const auto model = find_value<ExperimentModel>(key);
        if (key == "default") {
            everywhere = value;
        } else if (model && has_levels(*model)) {
            if (*model == ExperimentModel::compound && !compound)
                entry[key.c_str()].fail("is not read: compound models have none");
            single.emplace(*model, value);
        } else if (const auto family_ = find_value<Family>(key)) {
            for (const ModelKind kind : model_kinds())
                if (family(kind) == *family_) families.emplace(experiment_model(kind), value);
        } else {
            entry.fail("has the unknown key '" + printable(key) + "' (known: default, " + words_of<Family>() +
                       ", " + words_of<ModelKind>() + (compound ? ", compound)" : ")"));
        }
    }
    single.merge(families);
    for (const auto& [model, value] : single) models[model].*own = value;
}

/// [theta, phi] in degrees.
BtfDirection direction_of(const Entry& entry) {
    const std::vector<Entry> angles = entry.items();
    if (angles.size() != 2) entry.fail("is not [theta, phi] in degrees");
    const double theta = angles[0].number(), phi = angles[1].number();
    if (theta < 0.0 || theta >= 90.0)
        entry.fail("is not above the surface: theta is from 0, below 90 degrees");
    return {from_degrees(theta), from_degrees(phi)};
}

/// "all", {"number": N, "seed": S} or [{"view": …, "light": …}, …].
void read_directions(const Entry& entry, ExperimentBtf& btf) {
    if (entry.is_text("all")) return;
    if (entry.is_object()) {
        entry.check_keys({"number", "seed"});
        btf.number = entry["number"].integer(1, std::numeric_limits<int>::max());
        if (entry.holds("seed")) btf.seed = entry["seed"].whole(0, std::numeric_limits<std::int64_t>::max());
        return;
    }
    if (!entry.is_list()) entry.fail("is neither \"all\", nor a number of directions, nor a list of them");
    btf.named = entry.list([](const Entry& pair) {
        pair.check_keys({"view", "light"});
        return ExperimentDirections{direction_of(pair["view"]), direction_of(pair["light"])};
    });
}

ExperimentBtf btf_of(const Entry& entry) {
    ExperimentBtf btf;
    btf.set = entry["btf"].text();
    read_directions(entry["directions"], btf);
    if (entry.holds("btf_model")) btf.model = entry["btf_model"].text();
    if (entry.holds("coding")) btf.reading.coding = entry["coding"].one_of<BtfCoding>();
    if (entry.holds("colour")) btf.reading.space = entry["colour"].one_of<ColourSpace>();
    constexpr int most = 1 << 16;
    if (entry.holds("pixel_stride")) btf.reading.pixel_stride = entry["pixel_stride"].integer(1, most);
    if (entry.holds("view_stride")) btf.reading.view_stride = entry["view_stride"].integer(1, most);
    if (entry.holds("light_stride")) btf.reading.light_stride = entry["light_stride"].integer(1, most);
    return btf;
}

ExperimentPictures pictures_of(const Entry& entry) {
    constexpr int most = std::numeric_limits<int>::max();
    entry.check_keys({"material", "files", "btf", "btf_model", "directions", "coding", "colour",
                      "pixel_stride", "view_stride", "light_stride", "crop", "white"});
    ExperimentPictures pictures;
    pictures.material = entry["material"].text();
    if (entry.holds("btf")) {
        if (entry.holds("files")) entry.fail("has both 'files' and 'btf'");
        pictures.btf = btf_of(entry);
    } else {
        for (const char* key :
             {"btf_model", "directions", "coding", "colour", "pixel_stride", "view_stride", "light_stride"})
            if (entry.holds(key)) entry[key].fail("is read of a 'btf' alone");
        pictures.files = entry["files"].list([](const Entry& file) { return file.text(); });
    }
    if (entry.holds("crop")) {
        const std::vector<Entry> sides = entry["crop"].items();
        if (sides.size() != 4) entry["crop"].fail("is not [x, y, width, height]");
        pictures.crop = Crop{sides[0].integer(0, most), sides[1].integer(0, most), sides[2].integer(1, most),
                             sides[3].integer(1, most)};
    }
    if (entry.holds("white")) pictures.white = entry["white"].positive();
    return pictures;
}

/// What may differ from model to model.
void read_settings(const Entry& root, ExperimentConfig& config) {
    using Settings = ExperimentModelSettings;
    if (root.holds("estimators")) {
        read_by_model(root["estimators"], config.estimators, config.own, &Settings::estimators, false,
                      [](const Entry& value) {
                          return value.list([](const Entry& e) { return e.one_of<EstimatorChoice>(); });
                      });
    }
    if (root.holds("marginals")) {
        read_by_model(root["marginals"], config.marginals, config.own, &Settings::marginals, true,
                      [](const Entry& value) {
                          return value.list([](const Entry& e) { return e.one_of<MarginalMode>(); });
                      });
    }
    if (root.holds("noise")) {
        read_by_model(root["noise"], config.noise, config.own, &Settings::noise, true,
                      [](const Entry& value) { return value.one_of<NoiseForm>(); });
    }
    if (root.holds("gains")) {
        read_by_model(root["gains"], config.gains, config.own, &Settings::gains, false,
                      [](const Entry& value) { return value.one_of<GainMode>(); });
    }
}

}  // namespace

ExperimentConfig read_experiment(const fs::path& path) {
    const std::string asked = "read the experiment '" + path.string() + "'";
    ExperimentConfig config = experiment_from_text(
        bytes_of(path, asked), fs::absolute(path).parent_path().lexically_normal(), asked);
    if (config.name.empty()) config.name = path.stem().string();
    return config;
}

ExperimentConfig detail::experiment_from_text(const std::string& text, const fs::path& folder,
                                              const std::string& asked) {
    ExperimentConfig config;
    config.text = text;
    config.folder = folder;
    const json document = parsed(config.text, asked);
    const Entry root(document, "", asked);
    root.check_keys({"$schema", "name", "pictures", "models", "orders", "levels", "estimators", "marginals",
                     "seeds", "factor", "noise", "gains", "metric", "values", "size", "allow_invalid"});

    if (root.holds("$schema")) static_cast<void>(root["$schema"].text());  // for editors
    if (root.holds("name")) config.name = root["name"].text();
    for (const Entry& entry : root["pictures"].items()) config.pictures.push_back(pictures_of(entry));
    if (root.holds("models") && root["models"].is_text("all")) {
        // The ten, as ever: what existing files ask for does not grow.
        for (const ModelKind kind : model_kinds()) config.models.push_back(experiment_model(kind));
    } else {
        config.models =
            root["models"].list([](const Entry& model) { return model.one_of<ExperimentModel>(); });
    }
    config.orders = root["orders"].list([](const Entry& order) { return order.integer(1, max_order); });
    config.levels = root["levels"].list([](const Entry& levels) { return levels.integer(0, 30); });
    read_settings(root, config);
    if (root.holds("seeds")) {
        // SQLite's integers have a sign.
        constexpr std::uint64_t most = std::numeric_limits<std::int64_t>::max();
        config.seeds = root["seeds"].list([](const Entry& seed) { return seed.whole(0, most); });
    }
    if (root.holds("factor")) config.factor = root["factor"].integer(2, 1024);
    if (root.holds("metric")) config.metric = root["metric"].one_of<Metric>();
    if (root.holds("values")) config.values = root["values"].one_of<MeasuredValues>();
    if (root.holds("size")) {
        const std::vector<Entry> sides = root["size"].items();
        constexpr int most = std::numeric_limits<int>::max();
        if (sides.size() != 2) root["size"].fail("is not [width, height]");
        config.size = Size{sides[1].integer(1, most), sides[0].integer(1, most)};
    }
    if (root.holds("allow_invalid")) config.allow_invalid = root["allow_invalid"].flag();
    return config;
}

}  // namespace btfield
