#include <bit>
#include <cmath>
#include <string>
#include <type_traits>
#include <utility>

#include "btfield/btf_model.hpp"
#include "btfield/error.hpp"
#include "btfield/model_file.hpp"
#include "host/base/base64.hpp"
#include "host/base/strict_json.hpp"
#include "host/base/text.hpp"
#include "host/btf/btf_measured.hpp"
#include "host/btf/btf_model_json.hpp"
#include "host/model/model_json.hpp"

namespace btfield {

using namespace detail;
using namespace detail::json_reading;
using nlohmann::ordered_json;

namespace {

constexpr int most_planes = 64;

ordered_json model_json(const BtfModel& model, bool binary) {
    ordered_json value;
    value["format"] = btf_format;
    value["version"] = version_value(false, {});
    value["method"] = name(BtfMethod::joint);
    put_scope(value, model);
    std::vector<std::uint16_t> pairs;
    for (const BtfPair& pair : model.pairs) {
        pairs.push_back(static_cast<std::uint16_t>(pair.view));
        pairs.push_back(static_cast<std::uint16_t>(pair.light));
    }
    value["pairs"] = table_value(pairs, binary);
    if (!model.true_lights.empty()) value["true_lights"] = directions_value(model.true_lights);
    const BtfTables& tables = model.tables;
    value["mean"] = halves_value(tables.mean, binary);
    value["offset_unit"] = tables.offset_unit;
    value["offsets"] = table_value(tables.offsets, binary);
    value["weight_units"] = tables.weight_units;
    value["weights"] = table_value(tables.weights, binary);
    value["relief"] = model.relief;
    value["scale_factor"] = model.scale_factor;
    value["unexplained"] = model.unexplained;
    put_extent(value, model);
    value["surface"] = model_value(model.surface);
    return value;
}

void read_tables(Object& object, BtfModel& model, const Context& context) {
    const json& pairs = object.member("pairs");
    const std::size_t bytes =
        pairs.is_binary() ? pairs.get_binary().size() : text(pairs, "pairs", context).size() / 4 * 3;
    // A text may end in up to two bytes less than its letters have room for.
    std::size_t count = bytes / 4;
    if (!pairs.is_binary()) count = from_base64(text(pairs, "pairs", context)).size() / 4;
    if (count < 1 || count > most_btf_pairs) fail(context, "pairs has none, or too many");
    const auto indices = table_from<std::uint16_t>(pairs, "pairs", context, 2 * count);
    for (std::size_t i = 0; i < count; ++i) model.pairs.push_back({indices[2 * i], indices[2 * i + 1]});
    const std::size_t rows = count * static_cast<std::size_t>(model.colours);
    BtfTables& tables = model.tables;
    tables.mean = halves_from(object.member("mean"), "mean", context, rows);
    tables.offset_unit = object.get("offset_unit", real);
    tables.offsets = table_from<std::int16_t>(object.member("offsets"), "offsets", context, rows);
    tables.weight_units = object.get_list("weight_units", real);
    if (tables.weight_units.empty() || tables.weight_units.size() > static_cast<std::size_t>(most_planes))
        fail(context, "weight_units has none, or too many");
    tables.weights = table_from<std::int8_t>(object.member("weights"), "weights", context,
                                             rows * tables.weight_units.size());
}

BtfModel model_from_json(const json& value, Context context) {
    Object object(value, "", context);
    read_version(object, btf_format, context);
    read_btf_method(object, true, context);
    BtfModel model;
    read_scope(object, model, context);
    read_tables(object, model, context);
    if (object.has("true_lights")) model.true_lights = object.get_list("true_lights", direction_from);
    model.relief = object.get("relief", text);
    model.scale_factor = object.get("scale_factor", real);
    model.unexplained = object.get("unexplained", real);
    read_extent(object, model);
    model.surface = model_from(object.member("surface"), "surface", context);
    object.finish();
    try {
        check(model);
    } catch (const InputError& error) {
        fail(context, error.found());
    }
    return model;
}

void check_maps(const BtfModel& model) {
    const std::vector<MaterialMap>& maps = model.surface.provenance.maps;
    if (model.surface.planes != model.planes() + 1)
        refuse_model("its surface has " + counted(model.surface.planes, "plane") + ", not the height and " +
                     std::to_string(model.planes()));
    if (maps.size() != 2 || maps[0].role != MapRole::height || maps[0].planes != 1 ||
        maps[1].planes != model.planes())
        refuse_model("its surface is not a height and planes");
}

}  // namespace

void check(const BtfModel& model) {
    check_measured(model);
    const std::size_t rows = model.pairs.size() * static_cast<std::size_t>(model.colours);
    const BtfTables& tables = model.tables;
    if (model.planes() < 1 || tables.mean.size() != rows || tables.offsets.size() != rows ||
        tables.weights.size() != rows * tables.weight_units.size())
        refuse_model("its tables have not a row for each colour of each pair");
    for (const float mean : tables.mean)
        if (!(mean >= 0.0F) || !std::isfinite(mean)) refuse_model("a mean is not a number from 0 on");
    const auto sound = [](double unit) { return std::isfinite(unit) && unit > 0.0; };
    if (!sound(tables.offset_unit)) refuse_model("the unit of its offsets is not above 0");
    for (const double unit : tables.weight_units)
        if (!sound(unit)) refuse_model("a unit of its weights is not above 0");
    check_maps(model);
    check(model.surface);
}

BtfModel detail::joint_model_from(const json& value, const Context& context) {
    return model_from_json(value, context);
}

BtfModel read_btf_model(const std::filesystem::path& path) {
    const std::string asked = "read the BTF model '" + path.string() + "'";
    return model_from_json(parse_strictly(model_bytes(path, asked), asked), {asked});
}

void write_btf_model(const std::filesystem::path& path, const BtfModel& model) {
    check(model);
    write_model_value(path, model_json(model, is_cbor_name(path)),
                      "write the BTF model '" + path.string() + "'");
}

}  // namespace btfield
