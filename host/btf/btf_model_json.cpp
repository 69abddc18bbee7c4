#include "host/btf/btf_model_json.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

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

ordered_json means_value(const std::vector<float>& means, bool binary) {
    std::vector<std::uint16_t> halves;
    halves.reserve(means.size());
    for (const float mean : means) halves.push_back(half_of_float(mean));
    const auto is_half = [](float mean, std::uint16_t half) { return float_of_half(half) == mean; };
    if (std::ranges::equal(means, halves, is_half)) return table_value(halves, binary);
    std::vector<std::uint32_t> floats;
    floats.reserve(means.size());
    for (const float mean : means) floats.push_back(std::bit_cast<std::uint32_t>(mean));
    return table_value(floats, binary);
}

std::vector<float> means_from(const json& value, const std::string& where, const Context& context,
                              std::size_t count) {
    const std::vector<std::uint8_t> bytes = bytes_from(value, where, context);
    std::vector<float> means;
    if (bytes.size() == count * sizeof(std::uint16_t)) {
        for (const std::uint16_t half : numbers_of_bytes<std::uint16_t>(bytes))
            means.push_back(float_of_half(half));
    } else if (bytes.size() == count * sizeof(float)) {
        for (const std::uint32_t bits : numbers_of_bytes<std::uint32_t>(bytes))
            means.push_back(std::bit_cast<float>(bits));
    } else {
        fail(context, where + " has " + std::to_string(bytes.size()) + " bytes, neither " +
                          std::to_string(count * sizeof(std::uint16_t)) + " nor " +
                          std::to_string(count * sizeof(float)));
    }
    const auto is_mean = [](float mean) { return std::isfinite(mean) && !std::signbit(mean); };
    if (!std::ranges::all_of(means, is_mean))
        fail(context, where + " holds a number that is negative or not finite");
    return means;
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

std::vector<std::uint8_t> bits_of(const std::vector<std::size_t>& meant, std::size_t count) {
    std::vector<std::uint8_t> bytes((count + 7) / 8, 0);
    for (const std::size_t i : meant) bytes[i / 8] = static_cast<std::uint8_t>(bytes[i / 8] | 1U << i % 8);
    return bytes;
}

std::vector<std::size_t> bits_from(const json& value, const std::string& where, const Context& context,
                                   std::size_t count) {
    const auto bytes = table_from<std::uint8_t>(value, where, context, (count + 7) / 8);
    std::vector<std::size_t> meant;
    for (std::size_t i = 0; i < 8 * bytes.size(); ++i)
        if ((static_cast<unsigned>(bytes[i / 8]) >> i % 8 & 1U) != 0) meant.push_back(i);
    if (!meant.empty() && meant.back() >= count) fail(context, where + " means more than there are");
    return meant;
}

namespace {

/// Pairs and true lights.
void put_pairs(ordered_json& value, const BtfMeasured& model, bool binary) {
    const std::size_t all = model.views.size() * model.lights.size();
    if (model.pairs.size() < all) {
        std::vector<std::size_t> present;
        for (const BtfPair& pair : model.pairs) present.push_back(place_of(model, pair));
        value["present"] = bytes_value(bits_of(present, all), binary);
    }
    if (model.true_lights.empty()) return;
    ordered_json moved = ordered_json::array();
    for (std::size_t i = 0; i < model.true_lights.size(); ++i) {
        const BtfDirection& light = model.true_lights[i];
        if (!(light == model.lights[static_cast<std::size_t>(model.pairs[i].light)]))
            moved.push_back(ordered_json::array({i, light.theta, light.phi}));
    }
    value["moved_lights"] = std::move(moved);
}

/// Beside views and lights, which the model has.
void read_pairs(Object& object, BtfMeasured& model, const Context& context) {
    const std::size_t lights = model.lights.size(), all = model.views.size() * lights;
    if (all < 1 || all > most_possible_btf_pairs) fail(context, "it has no views or lights, or too many");
    const auto add = [&](std::size_t place) {
        model.pairs.push_back({static_cast<int>(place / lights), static_cast<int>(place % lights)});
    };
    if (object.has("present"))
        for (const std::size_t place : bits_from(object.member("present"), "present", context, all))
            add(place);
    else
        for (std::size_t place = 0; place < all; ++place) add(place);
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

}  // namespace

void put_scope(ordered_json& value, const BtfMeasured& model, bool binary) {
    value["size"] = size_value(model.size);
    value["colours"] = model.colours;
    value["colour_space"] = name(model.space);
    put_plane_meanings(value, model.names, {});
    value["white"] = model.white;
    value["views"] = directions_value(model.views);
    value["lights"] = directions_value(model.lights);
    put_pairs(value, model, binary);
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
    read_pairs(object, model, context);
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
