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
#include "host/base/half.hpp"
#include "host/base/strict_json.hpp"
#include "host/base/text.hpp"
#include "host/btf/direction_grid.hpp"
#include "host/model/model_json.hpp"
#include "host/pictures/picture_names.hpp"

namespace btfield {

using namespace detail;
using namespace detail::json_reading;
using nlohmann::ordered_json;

namespace {

constexpr int most_directions = 65536, most_colours = 64, most_planes = 64;
constexpr std::size_t most_pairs = std::size_t{1} << 22, most_possible_pairs = std::size_t{1} << 26;

// Numbers as bytes, lowest first.
template <typename Number>
std::vector<std::uint8_t> bytes_of(const std::vector<Number>& numbers) {
    std::vector<std::uint8_t> bytes;
    bytes.reserve(numbers.size() * sizeof(Number));
    for (const Number number : numbers) {
        const auto bits = static_cast<std::make_unsigned_t<Number>>(number);
        for (std::size_t i = 0; i < sizeof(Number); ++i)
            bytes.push_back(static_cast<std::uint8_t>(static_cast<unsigned>(bits) >> (8 * i) & 255U));
    }
    return bytes;
}

template <typename Number>
std::vector<Number> numbers_of(const std::vector<std::uint8_t>& bytes) {
    std::vector<Number> numbers(bytes.size() / sizeof(Number));
    for (std::size_t n = 0; n < numbers.size(); ++n) {
        unsigned bits = 0;
        for (std::size_t i = 0; i < sizeof(Number); ++i)
            bits |= static_cast<unsigned>(bytes[n * sizeof(Number) + i]) << (8 * i);
        numbers[n] = static_cast<Number>(bits);
    }
    return numbers;
}

template <typename Number>
ordered_json table_value(const std::vector<Number>& numbers, bool binary) {
    std::vector<std::uint8_t> bytes = bytes_of(numbers);
    return binary ? ordered_json::binary(std::move(bytes)) : ordered_json(base64(bytes));
}

template <typename Number>
std::vector<Number> table_from(const json& value, const std::string& where, const Context& context,
                               std::size_t count) {
    std::vector<std::uint8_t> bytes;
    if (value.is_binary())
        bytes = value.get_binary();
    else
        bytes = from_base64(text(value, where, context));
    if (bytes.size() != count * sizeof(Number))
        fail(context, where + " has " + std::to_string(bytes.size()) + " bytes, not " +
                          std::to_string(count * sizeof(Number)));
    return numbers_of<Number>(bytes);
}

/// Which of `count` are meant, a bit each, lowest first.
std::vector<std::uint8_t> bits_of(const std::vector<std::size_t>& meant, std::size_t count) {
    std::vector<std::uint8_t> bytes((count + 7) / 8, 0);
    for (const std::size_t i : meant) bytes[i / 8] |= static_cast<std::uint8_t>(1U << i % 8);
    return bytes;
}

/// Ascending.
std::vector<std::size_t> bits_from(const json& value, const std::string& where, const Context& context,
                                   std::size_t count) {
    const auto bytes = table_from<std::uint8_t>(value, where, context, (count + 7) / 8);
    std::vector<std::size_t> meant;
    for (std::size_t i = 0; i < 8 * bytes.size(); ++i)
        if ((static_cast<unsigned>(bytes[i / 8]) >> i % 8 & 1U) != 0) meant.push_back(i);
    if (!meant.empty() && meant.back() >= count) fail(context, where + " means more than there are");
    return meant;
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

ordered_json model_json(const BtfModel& model, bool binary) {
    ordered_json value;
    value["format"] = btf_format;
    value["version"] = version_value(false, {});
    value["size"] = size_value(model.size);
    value["colours"] = model.colours;
    value["colour_space"] = name(model.space);
    put_plane_meanings(value, model.names, {});
    value["white"] = model.white;
    value["views"] = directions_value(model.views);
    value["lights"] = directions_value(model.lights);
    const std::size_t lights = model.lights.size();
    std::vector<std::size_t> pairs;
    for (const BtfPair& pair : model.pairs)
        pairs.push_back(static_cast<std::size_t>(pair.view) * lights + static_cast<std::size_t>(pair.light));
    value["pairs"] = table_value(bits_of(pairs, model.views.size() * lights), binary);
    std::vector<std::size_t> moved;
    std::vector<BtfDirection> moved_to;
    for (std::size_t i = 0; i < model.true_lights.size(); ++i)
        if (!(model.true_lights[i] == model.lights[static_cast<std::size_t>(model.pairs[i].light)])) {
            moved.push_back(i);
            moved_to.push_back(model.true_lights[i]);
        }
    if (!moved.empty()) {
        value["moved"] = table_value(bits_of(moved, model.pairs.size()), binary);
        value["true_lights"] = directions_value(moved_to);
    }
    const BtfTables& tables = model.tables;
    std::vector<std::uint16_t> means;
    for (const float mean : tables.mean) means.push_back(half_of_float(mean));
    value["mean"] = table_value(means, binary);
    value["contrast"] = table_value(tables.contrast, binary);
    value["kept"] = table_value(
        bits_of(std::vector<std::size_t>(tables.kept.begin(), tables.kept.end()), model.pairs.size()),
        binary);
    value["weight_units"] = tables.weight_units;
    value["weights"] = table_value(tables.weights, binary);
    value["relief"] = model.relief;
    value["scale_factor"] = model.scale_factor;
    value["unexplained"] = model.unexplained;
    value["table_error"] = model.table_error;
    value["pictures"] = model.pictures;
    value["picture_bytes"] = model.picture_bytes;
    value["file_bytes"] = model.file_bytes;
    value["surface"] = model_value(model.surface);
    return value;
}

void read_pairs(Object& object, BtfModel& model, const Context& context) {
    const std::size_t lights = model.lights.size(), grid = model.views.size() * lights;
    if (grid < 1 || grid > most_possible_pairs) fail(context, "views and lights have no pairs, or too many");
    for (const std::size_t at : bits_from(object.member("pairs"), "pairs", context, grid))
        model.pairs.push_back({static_cast<int>(at / lights), static_cast<int>(at % lights)});
    if (!object.has("moved")) return;
    for (const BtfPair& pair : model.pairs)
        model.true_lights.push_back(model.lights[static_cast<std::size_t>(pair.light)]);
    const auto moved = bits_from(object.member("moved"), "moved", context, model.pairs.size());
    const auto to = object.get_list("true_lights", direction_from);
    if (to.size() != moved.size()) fail(context, "true_lights has not one for each that is moved");
    for (std::size_t i = 0; i < moved.size(); ++i) model.true_lights[moved[i]] = to[i];
}

void read_tables(Object& object, BtfModel& model, const Context& context) {
    const auto colours = static_cast<std::size_t>(model.colours);
    BtfTables& tables = model.tables;
    for (const std::uint16_t mean :
         table_from<std::uint16_t>(object.member("mean"), "mean", context, model.pairs.size() * colours)) {
        if (mean > 0x7bffU) fail(context, "mean holds a number that is negative or not finite");
        tables.mean.push_back(float_of_half(mean));
    }
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
    BtfModel model;
    model.size = object.get("size", json_reading::size);
    model.colours = object.get("colours", integer);
    if (model.colours < 1 || model.colours > most_colours) fail(context, "colours is no number of planes");
    model.space = object.get_name<ColourSpace>("colour_space");
    model.names = read_names(object, model.colours, context);
    model.white = object.get("white", real);
    model.views = object.get_list("views", direction_from);
    model.lights = object.get_list("lights", direction_from);
    read_pairs(object, model, context);
    read_tables(object, model, context);
    model.relief = object.get("relief", text);
    model.scale_factor = object.get("scale_factor", real);
    model.unexplained = object.get("unexplained", real);
    model.table_error = object.get("table_error", real);
    model.pictures = object.get("pictures", natural);
    model.picture_bytes = object.get("picture_bytes", natural);
    model.file_bytes = object.get("file_bytes", natural);
    model.surface = model_from(object.member("surface"), "surface", context);
    object.finish();
    try {
        check(model);
    } catch (const InputError& error) {
        fail(context, error.found());
    }
    return model;
}

[[noreturn]] void refuse(const std::string& found) {
    throw InputError("use a BTF model", found, "use one that btfield fitted");
}

void check_directions(const std::vector<BtfDirection>& directions, const std::string& what) {
    if (directions.empty() || directions.size() > static_cast<std::size_t>(most_directions))
        refuse("it has no " + what + ", or too many");
    for (const BtfDirection& d : directions)
        if (!std::isfinite(d.phi) || !(d.theta >= 0.0) || !(d.theta <= radians(89.0)))
            refuse("one of its " + what + " is " + text_of(d) + ", not above the surface");
}

void check_maps(const BtfModel& model) {
    const std::vector<MaterialMap>& maps = model.surface.provenance.maps;
    if (model.surface.planes != model.planes() + 1)
        refuse("its surface has " + counted(model.surface.planes, "plane") + ", not the height and " +
               std::to_string(model.planes()));
    if (maps.size() != 2 || maps[0].role != MapRole::height || maps[0].planes != 1 ||
        maps[1].planes != model.planes())
        refuse("its surface is not a height and planes");
}

}  // namespace

void check(const BtfModel& model) {
    if (model.size.height < 1 || model.size.width < 1) refuse("its pictures have no pixels");
    if (model.colours < 1 || model.colours > most_colours) refuse("its pictures have no planes, or too many");
    check_directions(model.views, "views");
    check_directions(model.lights, "lights");
    if (!model.true_lights.empty()) check_directions(model.true_lights, "true lights");
    if (!model.true_lights.empty() && model.true_lights.size() != model.pairs.size())
        refuse("it has true lights, but not one for each pair");
    if (model.pairs.empty() || model.pairs.size() > most_pairs ||
        model.views.size() * model.lights.size() > most_possible_pairs)
        refuse("it has no pair, or too many");
    const auto before = [](const BtfPair& a, const BtfPair& b) {
        return std::pair(a.view, a.light) < std::pair(b.view, b.light);
    };
    if (std::ranges::adjacent_find(model.pairs, [&](const BtfPair& a, const BtfPair& b) {
            return !before(a, b);
        }) != model.pairs.end())
        refuse("its pairs do not ascend");
    for (const BtfPair& pair : model.pairs)
        if (pair.view < 0 || pair.light < 0 || pair.view >= static_cast<int>(model.views.size()) ||
            pair.light >= static_cast<int>(model.lights.size()))
            refuse("a pair has a view or a light that it does not list");
    const BtfTables& tables = model.tables;
    if (tables.kept.empty() || tables.kept.back() >= model.pairs.size() ||
        std::ranges::adjacent_find(tables.kept, std::greater_equal<>()) != tables.kept.end())
        refuse("its tables keep no pairs, or not of its own in ascending order");
    const auto colours = static_cast<std::size_t>(model.colours);
    if (model.planes() < 1 || tables.mean.size() != model.pairs.size() * colours ||
        tables.contrast.size() != tables.mean.size() ||
        tables.weights.size() != tables.kept.size() * colours * tables.weight_units.size())
        refuse("its tables have not a row for each colour of each pair");
    for (const float mean : tables.mean)
        if (!(mean >= 0.0F) || !std::isfinite(mean)) refuse("a mean is not a number from 0 on");
    const auto sound = [](double unit) { return std::isfinite(unit) && unit > 0.0; };
    for (const double unit : tables.weight_units)
        if (!sound(unit)) refuse("a unit of its weights is not above 0");
    if (!sound(model.white)) refuse("its white is not above 0");
    check_maps(model);
    check(model.surface);
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
