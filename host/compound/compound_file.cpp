#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <utility>

#include "btfield/compound.hpp"
#include "btfield/error.hpp"
#include "btfield/model_file.hpp"
#include "host/base/base64.hpp"
#include "host/base/strict_json.hpp"
#include "host/compound/compound_json.hpp"
#include "host/compound/compound_names.hpp"
#include "host/compound/label_code.hpp"
#include "host/model/model_json.hpp"
#include "host/pictures/picture_names.hpp"

namespace btfield {

using namespace detail;
using namespace detail::json_reading;
using nlohmann::ordered_json;

namespace {

ordered_json control_value(const CompoundModel& model, bool binary) {
    ordered_json value;
    value["size"] = size_value(model.control.size);
    value["regions"] = model.control.regions;
    value["periodic"] = model.periodic;
    std::vector<std::uint8_t> code = encode_labels(model.control);
    value["labels"] = binary ? ordered_json::binary(std::move(code)) : ordered_json(base64(code));
    return value;
}

ordered_json region_value(const CompoundRegion& region) {
    ordered_json value;
    value["share"] = region.share;
    value["pixels"] = region.pixels;
    value["colour"] = region.colour;
    value["weights"] = region.weights;
    value["contrast"] = region.contrast;
    value["structure"] = region.structure;
    value["residual"] = model_value(region.residual);
    return value;
}

}  // namespace

namespace detail {

ordered_json compound_value(const CompoundModel& model, bool binary) {
    ordered_json value;
    value["format"] = compound_format;
    value["version"] = version_value(!model.names.empty() || !model.plane_spaces.empty(), model.provenance);
    value["size"] = size_value(model.size);
    value["planes"] = model.planes;
    value["colour_space"] = name(model.space);
    put_plane_meanings(value, model.names, model.plane_spaces);
    value["borders"] = name(model.borders);
    value["mean"] = model.mean;
    value["explained"] = model.explained;
    value["provenance"] = provenance_value(model.provenance);
    value["control"] = control_value(model, binary);
    ordered_json regions = ordered_json::array();
    for (const CompoundRegion& region : model.regions) regions.push_back(region_value(region));
    value["regions"] = std::move(regions);
    return value;
}

}  // namespace detail

namespace {

ControlField read_control(const json& value, const std::string& where, const Context& context,
                          bool& periodic) {
    Object object(value, where, context);
    ControlField field;
    field.size = object.get("size", size);
    field.regions = object.get("regions", integer);
    periodic = object.get("periodic", truth);
    const json& labels = object.member("labels");
    object.finish();
    // Before memory is taken for what they say.
    constexpr int most_rolled = 16384;
    if (field.size.height < 1 || field.size.width < 1 || field.size.height > most_rolled ||
        field.size.width > most_rolled || field.regions < 1 || field.regions > most_regions)
        fail(context, where + " has a size or a number of regions that no control field has");
    if (labels.is_binary()) {
        const std::vector<std::uint8_t>& code = labels.get_binary();
        field.labels = decode_labels(code, field.size, field.regions, context.asked);
    } else {
        field.labels = decode_labels(from_base64(text(labels, where + ".labels", context)), field.size,
                                     field.regions, context.asked);
    }
    return field;
}

CompoundRegion read_region(const json& value, const std::string& where, const Context& context) {
    Object object(value, where, context);
    CompoundRegion region;
    region.share = object.get("share", real);
    region.pixels = static_cast<std::size_t>(object.get("pixels", natural));
    region.colour = object.get_list("colour", real);
    region.weights = object.get_list("weights", real);
    // Earlier files have no pairs of neighbours.
    if (const std::size_t filters = region.weights.size() / std::max<std::size_t>(1, region.colour.size());
        filters == static_cast<std::size_t>(context_filters - context_pairs))
        region.weights.resize(static_cast<std::size_t>(context_filters) * region.colour.size(), 0.0);
    region.contrast = object.get("contrast", real);
    region.structure = object.get("structure", real);
    region.residual = model_from(object.member("residual"), where + ".residual", context);
    object.finish();
    return region;
}

}  // namespace

CompoundModel detail::compound_from(const json& value, Context context) {
    Object object(value, "", context);
    read_version(object, compound_format, context);
    CompoundModel model;
    model.size = object.get("size", size);
    model.planes = object.get("planes", integer);
    model.space = object.get_name<ColourSpace>("colour_space");
    model.names = read_names(object, model.planes, context);
    model.plane_spaces = read_plane_spaces(object, model.planes, context);
    model.borders = object.get_name<Borders>("borders");
    model.mean = object.get_list("mean", real);
    model.explained = object.get("explained", real);
    model.provenance = object.get("provenance", read_provenance);
    model.control = read_control(object.member("control"), "control", context, model.periodic);
    model.regions = object.get_list("regions", read_region);
    object.finish();
    try {
        check(model);
    } catch (const InputError& error) {
        fail(context, error.found());
    }
    return model;
}

CompoundModel read_compound(const std::filesystem::path& path) {
    const std::string asked = "read the compound model '" + path.string() + "'";
    return compound_from(parse_strictly(model_bytes(path, asked), asked), {asked});
}

void write_compound(const std::filesystem::path& path, const CompoundModel& model) {
    check(model);
    write_model_value(path, compound_value(model, is_cbor_name(path)),
                      "write the compound model '" + path.string() + "'");
}

std::variant<TextureModel, CompoundModel> read_any_model(const std::filesystem::path& path) {
    const std::string asked = "read the model '" + path.string() + "'";
    const json value = parse_strictly(model_bytes(path, asked), asked);
    const auto format = value.find("format");
    if (format != value.end() && *format == compound_format) return compound_from(value, {asked});
    return model_from(value, "", {asked});
}

}  // namespace btfield
