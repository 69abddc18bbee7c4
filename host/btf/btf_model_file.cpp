#include <algorithm>
#include <cmath>
#include <functional>
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
#include "host/btf/surface_field.hpp"
#include "host/compound/compound_json.hpp"
#include "host/model/model_json.hpp"

namespace btfield {

using namespace detail;
using namespace detail::json_reading;
using nlohmann::ordered_json;

namespace {

constexpr int most_planes = 64;

constexpr const char* sample_format = "btfield-surface";

ordered_json sample_value(const SurfaceSample& sample, bool binary) {
    ordered_json value;
    value["format"] = sample_format;
    value["version"] = version_value(false, {});
    value["size"] = size_value(sample.size);
    value["height_unit"] = sample.height_unit;
    value["height"] = table_value(sample.height, binary);
    value["plane_units"] = sample.plane_units;
    value["planes"] = table_value(sample.planes, binary);
    return value;
}

SurfaceSample sample_from(const json& value, Context context) {
    Object object(value, "surface", context);
    read_version(object, sample_format, context);
    SurfaceSample sample;
    sample.size = object.get("size", json_reading::size);
    if (sample.size.height < 1 || sample.size.width < 1 || sample.size.height > 16384 ||
        sample.size.width > 16384)
        fail(context, "surface.size is no size of a sample");
    sample.height_unit = object.get("height_unit", real);
    const std::size_t pixels = area(sample.size);
    sample.height = table_from<std::int16_t>(object.member("height"), "surface.height", context, pixels);
    sample.plane_units = object.get_list("plane_units", real);
    sample.planes = table_from<std::int8_t>(object.member("planes"), "surface.planes", context,
                                            pixels * sample.plane_units.size());
    object.finish();
    return sample;
}

ordered_json surface_value(const BtfModel& model, bool binary) {
    if (const auto* field = std::get_if<TextureModel>(&model.surface)) return model_value(*field);
    if (const auto* compound = std::get_if<CompoundModel>(&model.surface))
        return compound_value(*compound, binary);
    return sample_value(std::get<SurfaceSample>(model.surface), binary);
}

SurfaceField surface_from(const json& value, const Context& context) {
    const auto format = value.is_object() ? value.find("format") : value.end();
    if (value.is_object() && format != value.end()) {
        if (*format == compound_format) return compound_from(value, context);
        if (*format == sample_format) return sample_from(value, context);
    }
    return model_from(value, "surface", context);
}

ordered_json model_json(const BtfModel& model, bool binary) {
    ordered_json value;
    value["format"] = btf_format;
    value["version"] = version_value(false, {});
    value["method"] = name(BtfMethod::joint);
    put_scope(value, model, binary);
    const BtfTables& tables = model.tables;
    value["mean"] = means_value(tables.mean, binary);
    value["contrast"] = table_value(tables.contrast, binary);
    value["kept"] = bytes_value(
        bits_of(std::vector<std::size_t>(tables.kept.begin(), tables.kept.end()), model.pairs.size()),
        binary);
    value["weight_units"] = tables.weight_units;
    value["weights"] = table_value(tables.weights, binary);
    value["relief"] = model.relief;
    value["scale_factor"] = model.scale_factor;
    value["unexplained"] = model.unexplained;
    value["table_error"] = model.table_error;
    put_extent(value, model);
    value["surface"] = surface_value(model, binary);
    return value;
}

void read_tables(Object& object, BtfModel& model, const Context& context) {
    const auto colours = static_cast<std::size_t>(model.colours);
    BtfTables& tables = model.tables;
    tables.mean = means_from(object.member("mean"), "mean", context, model.pairs.size() * colours);
    tables.contrast =
        table_from<std::int8_t>(object.member("contrast"), "contrast", context, model.pairs.size() * colours);
    for (const std::size_t pair : bits_from(object.member("kept"), "kept", context, model.pairs.size()))
        tables.kept.push_back(static_cast<std::uint32_t>(pair));
    const std::size_t rows = tables.kept.size() * colours;
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
    model.relief = object.get("relief", text);
    model.scale_factor = object.get("scale_factor", real);
    model.unexplained = object.get("unexplained", real);
    model.table_error = object.get("table_error", real);
    read_extent(object, model);
    model.surface = surface_from(object.member("surface"), context);
    object.finish();
    try {
        check(model);
    } catch (const InputError& error) {
        fail(context, error.found());
    }
    return model;
}

}  // namespace

void check(const BtfModel& model) {
    check_measured(model);
    const BtfTables& tables = model.tables;
    if (tables.kept.empty() || tables.kept.back() >= model.pairs.size() ||
        std::ranges::adjacent_find(tables.kept, std::greater_equal<>()) != tables.kept.end())
        refuse_model("its tables keep no pairs, or not of its own in ascending order");
    const auto colours = static_cast<std::size_t>(model.colours);
    if (model.planes() < 1 || tables.mean.size() != model.pairs.size() * colours ||
        tables.contrast.size() != tables.mean.size() ||
        tables.weights.size() != tables.kept.size() * colours * tables.weight_units.size())
        refuse_model("its tables have not a row for each colour of each pair");
    for (const float mean : tables.mean)
        if (!(mean >= 0.0F) || !std::isfinite(mean)) refuse_model("a mean is not a number from 0 on");
    const auto sound = [](double unit) { return std::isfinite(unit) && unit > 0.0; };
    for (const double unit : tables.weight_units)
        if (!sound(unit)) refuse_model("a unit of its weights is not above 0");
    check_surface(model.surface, model.planes());
}

ordered_json detail::joint_model_value(const BtfModel& model, bool binary) {
    return model_json(model, binary);
}

BtfModel detail::joint_model_from(const json& value, const Context& context) {
    return model_from_json(value, context);
}

BtfModel read_btf_model(const std::filesystem::path& path) {
    const std::string asked = "read the BTF model '" + path.string() + "'";
    return model_from_json(parse_strictly(model_bytes(path, asked, "'btfield btf fit'"), asked), {asked});
}

void write_btf_model(const std::filesystem::path& path, const BtfModel& model) {
    check(model);
    write_model_value(path, model_json(model, is_cbor_name(path)),
                      "write the BTF model '" + path.string() + "'");
}

}  // namespace btfield
