#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <utility>

#include "btfield/compound.hpp"
#include "btfield/error.hpp"
#include "btfield/model_file.hpp"
#include "host/base/strict_json.hpp"
#include "host/compound/compound_names.hpp"
#include "host/compound/label_code.hpp"
#include "host/model/model_json.hpp"
#include "host/pictures/picture_names.hpp"

namespace btfield {

using namespace detail;
using namespace detail::json_reading;
using nlohmann::ordered_json;

namespace {

constexpr std::string_view base64_digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// RFC 4648, padded.
std::string base64(const std::vector<std::uint8_t>& bytes) {
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
        std::uint32_t word = 0;
        for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (k < count ? bytes[i + k] : 0U);
        for (std::size_t k = 0; k < 4; ++k)
            text += k <= count ? base64_digits[word >> (18 - 6 * k) & 63U] : '=';
    }
    return text;
}

/// As base64() writes it; nothing of any other text.
std::vector<std::uint8_t> from_base64(std::string_view text) {
    std::vector<std::uint8_t> bytes;
    if (text.size() % 4 != 0) return bytes;
    std::uint32_t word = 0;
    unsigned bits = 0;
    for (const char c : text) {
        const std::size_t digit = base64_digits.find(c);
        if (digit == std::string_view::npos) break;  // padding, as the comparison sees
        word = word << 6 | static_cast<std::uint32_t>(digit);
        bits += 6;
        if (bits < 8) continue;
        bits -= 8;
        bytes.push_back(static_cast<std::uint8_t>(word >> bits & 255U));
    }
    if (base64(bytes) != text) bytes.clear();
    return bytes;
}

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
    region.contrast = object.get("contrast", real);
    region.structure = object.get("structure", real);
    region.residual = model_from(object.member("residual"), where + ".residual", context);
    object.finish();
    return region;
}

CompoundModel compound_from(const json& value, Context context) {
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

}  // namespace

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
