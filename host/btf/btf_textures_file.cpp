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
    put_scope(value, model, binary);
    value["match"] = name(model.match);
    if (model.match == BtfMatch::means) {
        value["means"] = means_value(model.means, binary);
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
    value["texture_means"] = means_value(model.texture_means, binary);
    put_extent(value, model);
    value["textures"] = textures_value(model.textures, binary);
    return value;
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
    const auto colours = static_cast<std::size_t>(model.colours);
    model.match = object.get_name<BtfMatch>("match");
    if (model.match == BtfMatch::means) {
        const std::size_t rows = model.pairs.size() * colours;
        model.means = means_from(object.member("means"), "means", context, rows);
        model.contrasts = table_from<std::uint8_t>(object.member("contrasts"), "contrasts", context, rows);
    }
    model.textures = textures_from(object.member("textures"), "textures", context);
    read_labels(object, model, context);
    model.texture_means =
        means_from(object.member("texture_means"), "texture_means", context, model.textures.size() * colours);
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
    return parse_strictly(model_bytes(path, asked, "'btfield btf fit'"), asked);
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

ordered_json detail::textures_model_value(const BtfTextures& model, bool binary) {
    return textures_json(model, binary);
}

std::variant<BtfModel, BtfTextures> detail::btf_from(const json& value, const Context& context) {
    if (method_of(value, context) == BtfMethod::joint) return joint_model_from(value, context);
    return textures_model_from(value, context);
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
    return btf_from(parsed(path, asked), {asked});
}

}  // namespace btfield
