#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "btfield/btf_textures.hpp"
#include "btfield/error.hpp"
#include "btfield/model_file.hpp"
#include "host/base/half.hpp"
#include "host/base/strict_json.hpp"
#include "host/btf/btf_measured.hpp"
#include "host/btf/btf_model_json.hpp"
#include "host/btf/btf_names.hpp"
#include "host/btf/direction_grid.hpp"
#include "host/btf/texture_code.hpp"
#include "host/model/model_json.hpp"

namespace btfield {

using namespace detail;
using namespace detail::json_reading;
using nlohmann::ordered_json;

namespace {

constexpr std::size_t most_small_labels = 256;

std::size_t place_of(const BtfMeasured& model, const BtfPair& pair) {
    return static_cast<std::size_t>(pair.view) * model.lights.size() + static_cast<std::size_t>(pair.light);
}

bool has_all_pairs(const BtfMeasured& model) {
    return model.pairs.size() == model.views.size() * model.lights.size();
}

/// A bit for each view and light, lowest first.
std::vector<std::uint8_t> presence_of(const BtfMeasured& model) {
    std::vector<std::uint8_t> bits((model.views.size() * model.lights.size() + 7) / 8);
    for (const BtfPair& pair : model.pairs) {
        const std::size_t place = place_of(model, pair);
        bits[place / 8] = static_cast<std::uint8_t>(bits[place / 8] | 1U << (place % 8));
    }
    return bits;
}

/// Lights that are not where their index says: list of [pair, θ, φ].
ordered_json moved_lights(const BtfMeasured& model) {
    ordered_json moved = ordered_json::array();
    for (std::size_t i = 0; i < model.true_lights.size(); ++i) {
        const BtfDirection& light = model.true_lights[i];
        if (light == model.lights[static_cast<std::size_t>(model.pairs[i].light)]) continue;
        moved.push_back(ordered_json::array({i, light.theta, light.phi}));
    }
    return moved;
}

bool is_identity(const auto& indices) {
    for (std::size_t i = 0; i < indices.size(); ++i)
        if (indices[i] != i) return false;
    return true;
}

ordered_json textures_json(const BtfTextures& model, bool binary) {
    ordered_json value;
    value["format"] = btf_format;
    value["version"] = version_value(false, {});
    value["method"] = name(model.method);
    put_scope(value, model);
    if (!has_all_pairs(model)) value["present"] = bytes_value(presence_of(model), binary);
    if (!model.true_lights.empty()) value["moved_lights"] = moved_lights(model);
    value["match"] = name(model.match);
    if (model.match == BtfMatch::means) {
        value["means"] = halves_value(model.means, binary);
        value["contrasts"] = bytes_value(model.contrasts, binary);
    }
    // Of each, nothing else is the rule.
    if (!is_identity(model.labels)) {
        if (model.textures.size() <= most_small_labels)
            value["labels"] = bytes_value({model.labels.begin(), model.labels.end()}, binary);
        else
            value["labels"] = table_value(model.labels, binary);
    }
    if (!is_identity(model.sources)) value["sources"] = table_value(model.sources, binary);
    value["texture_means"] = halves_value(model.texture_means, binary);
    put_extent(value, model);
    value["textures"] = textures_value(model.textures, binary);
    return value;
}

void read_pairs(Object& object, BtfTextures& model, const Context& context) {
    const std::size_t all = model.views.size() * model.lights.size();
    if (all < 1 || all > most_btf_pairs) fail(context, "it has no views or lights, or too many");
    std::vector<std::uint8_t> bits((all + 7) / 8, 255);
    if (object.has("present"))
        bits = table_from<std::uint8_t>(object.member("present"), "present", context, bits.size());
    for (std::size_t place = 0; place < all; ++place)
        if ((bits[place / 8] >> (place % 8) & 1U) != 0)
            model.pairs.push_back({static_cast<int>(place / model.lights.size()),
                                   static_cast<int>(place % model.lights.size())});
    if (!object.has("moved_lights")) return;
    for (const BtfPair& pair : model.pairs)
        model.true_lights.push_back(model.lights[static_cast<std::size_t>(pair.light)]);
    const json& moved = array(object.member("moved_lights"), "moved_lights", context);
    for (std::size_t i = 0; i < moved.size(); ++i) {
        const std::string where = element("moved_lights", i);
        if (array(moved[i], where, context).size() != 3)
            fail(context, where + " is not a pair, theta and phi");
        const std::uint64_t pair = natural(moved[i][0], where, context);
        if (pair >= model.pairs.size()) fail(context, where + " has a pair that is not there");
        model.true_lights[pair] = {real(moved[i][1], where, context), real(moved[i][2], where, context)};
    }
}

/// Those that a list which is left out has.
template <typename Index>
std::vector<Index> identity(std::size_t count) {
    std::vector<Index> indices(count);
    for (std::size_t i = 0; i < count; ++i) indices[i] = static_cast<Index>(i);
    return indices;
}

void read_labels(Object& object, BtfTextures& model, const Context& context) {
    const std::size_t pairs = model.pairs.size(), textures = model.textures.size();
    if (!object.has("labels")) {
        model.labels = identity<std::uint16_t>(pairs);
    } else if (textures <= most_small_labels) {
        const auto small = table_from<std::uint8_t>(object.member("labels"), "labels", context, pairs);
        model.labels.assign(small.begin(), small.end());
    } else {
        model.labels = table_from<std::uint16_t>(object.member("labels"), "labels", context, pairs);
    }
    model.sources = object.has("sources")
                        ? table_from<std::uint32_t>(object.member("sources"), "sources", context, textures)
                        : identity<std::uint32_t>(textures);
}

BtfTextures textures_model_from(const json& value, Context context) {
    Object object(value, "", context);
    read_version(object, btf_format, context);
    BtfTextures model;
    model.method = read_btf_method(object, false, context);
    read_scope(object, model, context);
    read_pairs(object, model, context);
    const auto colours = static_cast<std::size_t>(model.colours);
    model.match = object.get_name<BtfMatch>("match");
    if (model.match == BtfMatch::means) {
        const std::size_t rows = model.pairs.size() * colours;
        model.means = halves_from(object.member("means"), "means", context, rows);
        model.contrasts = table_from<std::uint8_t>(object.member("contrasts"), "contrasts", context, rows);
    }
    model.textures = textures_from(object.member("textures"), "textures", context);
    read_labels(object, model, context);
    model.texture_means = halves_from(object.member("texture_means"), "texture_means", context,
                                      model.textures.size() * colours);
    read_extent(object, model);
    object.finish();
    try {
        check(model);
    } catch (const InputError& error) {
        fail(context, error.found());
    }
    return model;
}

json parsed(const std::filesystem::path& path, const std::string& asked) {
    return parse_strictly(model_bytes(path, asked), asked);
}

std::string asked_model(const std::filesystem::path& path) {
    return "read the BTF model '" + path.string() + "'";
}

BtfMethod method_of(const json& value, const Context& context) {
    Context about = context;
    Object object(value, "", about);
    read_version(object, btf_format, about);
    return object.has("method") ? object.get_name<BtfMethod>("method") : BtfMethod::joint;
}

void check_tables(const BtfTextures& model) {
    const auto colours = static_cast<std::size_t>(model.colours);
    const auto sound = [](float mean) { return mean >= 0.0F && mean <= 65504.0F; };
    if (model.texture_means.size() != model.textures.size() * colours ||
        !std::ranges::all_of(model.texture_means, sound))
        refuse_model("its textures have not each a mean from 0 on of each colour");
    if (model.labels.size() != model.pairs.size() || model.sources.size() != model.textures.size())
        refuse_model("not each pair has a texture, or not each texture a pair");
    if (std::ranges::any_of(model.labels, [&](std::size_t l) { return l >= model.textures.size(); }))
        refuse_model("a pair has a texture that is not there");
    if (std::ranges::any_of(model.sources, [&](std::size_t s) { return s >= model.pairs.size(); }))
        refuse_model("a texture is of a pair that is not there");
    const std::size_t rows = model.match == BtfMatch::means ? model.pairs.size() * colours : 0;
    if (model.means.size() != rows || model.contrasts.size() != rows)
        refuse_model("its tables have not a row for each colour of each pair");
    if (!std::ranges::all_of(model.means, sound)) refuse_model("a mean is not a number from 0 on");
}

}  // namespace

void check(const BtfTextures& model) {
    check_measured(model);
    if (model.method == BtfMethod::joint) refuse_model("textures are not of the method joint");
    for (std::size_t i = 1; i < model.pairs.size(); ++i)
        if (place_of(model, model.pairs[i - 1]) >= place_of(model, model.pairs[i]))
            refuse_model("its pairs are not in order, view by view");
    if (model.textures.empty() || model.textures.size() > most_btf_textures)
        refuse_model("it has no texture, or too many");
    check_tables(model);
    for (const TextureModel& texture : model.textures) {
        if (texture.planes != model.colours) refuse_model("a texture has not the colours of the pictures");
        check(texture);
    }
}

BtfTexturesParts parts_of(const BtfTextures& model, std::uint64_t bytes) {
    BtfTexturesParts parts;
    if (!is_identity(model.labels))
        parts.labels = model.labels.size() * (model.textures.size() <= most_small_labels ? 1 : 2);
    parts.means = 2 * model.means.size();
    parts.contrasts = model.contrasts.size();
    for (const TextureModel& texture : model.textures) parts.textures += coded_bytes(texture);
    const std::uint64_t known = parts.labels + parts.means + parts.contrasts + parts.textures;
    parts.rest = bytes > known ? bytes - known : 0;
    return parts;
}

BtfTextures read_btf_textures(const std::filesystem::path& path) {
    const std::string asked = asked_model(path);
    return textures_model_from(parsed(path, asked), {asked});
}

void write_btf_textures(const std::filesystem::path& path, const BtfTextures& model) {
    check(model);
    write_model_value(path, textures_json(model, is_cbor_name(path)),
                      "write the BTF model '" + path.string() + "'");
}

BtfMethod btf_method_of(const std::filesystem::path& path) {
    const std::string asked = asked_model(path);
    return method_of(parsed(path, asked), {asked});
}

std::variant<BtfModel, BtfTextures> read_any_btf(const std::filesystem::path& path) {
    const std::string asked = asked_model(path);
    const json value = parsed(path, asked);
    if (method_of(value, {asked}) == BtfMethod::joint) return joint_model_from(value, {asked});
    return textures_model_from(value, {asked});
}

}  // namespace btfield
