#include "host/btf/btf_model_json.hpp"

#include "host/base/half.hpp"
#include "host/btf/btf_measured.hpp"
#include "host/btf/btf_names.hpp"
#include "host/model/model_json.hpp"
#include "host/pictures/picture_names.hpp"

namespace btfield::detail {

using namespace json_reading;
using nlohmann::ordered_json;

ordered_json bytes_value(std::vector<std::uint8_t> bytes, bool binary) {
    return binary ? ordered_json::binary(std::move(bytes)) : ordered_json(base64(bytes));
}

std::vector<std::uint8_t> bytes_from(const json& value, const std::string& where, const Context& context) {
    if (value.is_binary()) return value.get_binary();
    return from_base64(text(value, where, context));
}

ordered_json halves_value(const std::vector<float>& values, bool binary) {
    std::vector<std::uint16_t> halves;
    halves.reserve(values.size());
    for (const float value : values) halves.push_back(half_of_float(value));
    return table_value(halves, binary);
}

std::vector<float> halves_from(const json& value, const std::string& where, const Context& context,
                               std::size_t count) {
    std::vector<float> values;
    values.reserve(count);
    for (const std::uint16_t half : table_from<std::uint16_t>(value, where, context, count)) {
        if (half > 0x7bffU) fail(context, where + " holds a number that is negative or not finite");
        values.push_back(float_of_half(half));
    }
    return values;
}

ordered_json directions_value(const std::vector<BtfDirection>& directions) {
    ordered_json list = ordered_json::array();
    for (const BtfDirection& d : directions) list.push_back({d.theta, d.phi});
    return list;
}

BtfDirection direction_from(const json& value, const std::string& where, const Context& context) {
    const std::vector<double> numbers = list(value, where, context, real);
    if (numbers.size() != 2) fail(context, where + " is not theta and phi");
    return {numbers[0], numbers[1]};
}

void put_scope(ordered_json& value, const BtfMeasured& model) {
    value["size"] = size_value(model.size);
    value["colours"] = model.colours;
    value["colour_space"] = name(model.space);
    put_plane_meanings(value, model.names, {});
    value["white"] = model.white;
    value["views"] = directions_value(model.views);
    value["lights"] = directions_value(model.lights);
}

void read_scope(Object& object, BtfMeasured& model, const Context& context) {
    model.size = object.get("size", json_reading::size);
    model.colours = object.get("colours", integer);
    if (model.colours < 1 || model.colours > most_btf_colours)
        fail(context, "colours is no number of planes");
    model.space = object.get_name<ColourSpace>("colour_space");
    model.names = read_names(object, model.colours, context);
    model.white = object.get("white", real);
    model.views = object.get_list("views", direction_from);
    model.lights = object.get_list("lights", direction_from);
}

void put_extent(ordered_json& value, const BtfMeasured& model) {
    value["pictures"] = model.pictures;
    value["picture_bytes"] = model.picture_bytes;
    value["file_bytes"] = model.file_bytes;
}

void read_extent(Object& object, BtfMeasured& model) {
    model.pictures = object.get("pictures", natural);
    model.picture_bytes = object.get("picture_bytes", natural);
    model.file_bytes = object.get("file_bytes", natural);
}

BtfMethod read_btf_method(Object& object, bool joint, const Context& context) {
    const BtfMethod method = object.has("method") ? object.get_name<BtfMethod>("method") : BtfMethod::joint;
    if (joint && method != BtfMethod::joint)
        fail(context,
             "it holds textures of pictures (method " + std::string(name(method)) +
                 "), not planes of a surface",
             "use a model of the method joint");
    if (!joint && method == BtfMethod::joint)
        fail(context, "it holds planes of a surface (method joint), not textures of pictures",
             "use a model of the method segment or each");
    return method;
}

}  // namespace btfield::detail
