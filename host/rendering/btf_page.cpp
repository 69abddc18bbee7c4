#include "btfield/btf_page.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/base64.hpp"
#include "host/base/text.hpp"
#include "host/btf/direction_table.hpp"
#include "host/rendering/direction_lattice.hpp"
#include "host/rendering/lit_table.hpp"
#include "host/rendering/page_texts.hpp"

namespace btfield {

using namespace detail;

namespace {

using Json = nlohmann::ordered_json;

/// Of the square of directions: odd, so that theta 0 is on it.
constexpr int side = 11;

using Bytes = std::vector<std::uint8_t>;

void append_word(Bytes& bytes, int value) {
    bytes.push_back(static_cast<std::uint8_t>(value & 0xFF));
    bytes.push_back(static_cast<std::uint8_t>((value >> 8) & 0xFF));
}

/// The least and the largest value, and what their difference is a unit of; 0 where there is none.
struct Bounds {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    void take(double value) {
        low = std::min(low, value);
        high = std::max(high, value);
    }
    [[nodiscard]] double range() const { return high - low; }
    [[nodiscard]] int step(double value, int steps) const {
        return range() > 0.0 ? static_cast<int>(std::lround((value - low) / range() * steps)) : 0;
    }
};

Bounds bounds_of(std::span<const float> values) {
    const auto [low, high] = std::ranges::minmax_element(values);
    return {static_cast<double>(*low), static_cast<double>(*high)};
}

/// Whole numbers of a value that is 0 in the middle.
double unit_of(double largest, int steps) {
    return largest > 0.0 ? largest / steps : 1.0;
}

using Texts = std::vector<std::pair<std::string, std::string>>;

/// Planes in 8 bits, four to a layer.
std::string planes_data(const Image& surface, int planes, Json& told) {
    const std::size_t pixels = area(surface.size());
    Bytes bytes(pixels * static_cast<std::size_t>((planes + 3) / 4 * 4));
    for (int k = 0; k < planes; ++k) {
        const auto plane = surface.plane(k + 1);
        const Bounds bounds = bounds_of(plane);
        told["planeMiddle"].push_back(0.5 * (bounds.low + bounds.high));
        told["planeRange"].push_back(bounds.range());
        const std::size_t layer = static_cast<std::size_t>(k / 4) * pixels * 4;
        for (std::size_t p = 0; p < pixels; ++p)
            bytes[layer + 4 * p + static_cast<std::size_t>(k % 4)] =
                static_cast<std::uint8_t>(bounds.step(static_cast<double>(plane[p]), 255));
    }
    return base64(bytes);
}

std::string height_data(const Image& surface, Json& told) {
    const Bounds bounds = bounds_of(surface.plane(0));
    told["heightLow"] = bounds.low;
    told["heightStep"] = bounds.range() / 65535.0;
    Bytes bytes;
    for (const float value : surface.plane(0))
        append_word(bytes, bounds.step(static_cast<double>(value), 65535));
    return base64(bytes);
}

/// Logarithms of means over l_z, in shares of white, and offsets in 16 bits, weights in 8.
void add_table(const std::string& name, std::span<const PictureWeights> entries, double white,
               std::size_t planes, Json& told, Texts& texts) {
    Bounds means;
    double largest = 0.0;
    std::vector<double> units(planes);
    for (const PictureWeights& entry : entries) {
        for (const double mean : entry.mean) means.take(std::log(mean / white));
        for (const double offset : entry.offsets) largest = std::max(largest, std::abs(offset));
        for (std::size_t i = 0; i < entry.weights.size(); ++i)
            units[i % planes] = std::max(units[i % planes], std::abs(entry.weights[i]));
    }
    const double unit = unit_of(largest, 32767);
    for (double& each : units) each = unit_of(each, 127);
    told["meanLow"] = means.low;
    told["meanStep"] = means.range() / 65535.0;
    told["offsetUnit"] = unit;
    told["weightUnits"] = units;
    Bytes mean_bytes, offset_bytes, weight_bytes;
    for (const PictureWeights& entry : entries) {
        for (const double mean : entry.mean)
            append_word(mean_bytes, means.step(std::log(mean / white), 65535));
        for (const double offset : entry.offsets)
            append_word(offset_bytes, static_cast<int>(std::lround(offset / unit)));
        for (std::size_t i = 0; i < entry.weights.size(); ++i)
            weight_bytes.push_back(
                static_cast<std::uint8_t>(std::lround(entry.weights[i] / units[i % planes]) & 0xFF));
    }
    texts.emplace_back(name + "_MEANS", base64(mean_bytes));
    texts.emplace_back(name + "_OFFSETS", base64(offset_bytes));
    texts.emplace_back(name + "_WEIGHTS", base64(weight_bytes));
}

/// The pairs' own values.
std::vector<PictureWeights> measured_entries(const BtfModel& model, const DirectionTable& table,
                                             std::size_t planes) {
    std::vector<PictureWeights> entries;
    for (const DirectionPair& pair : direction_pairs(model))
        entries.push_back(first_planes(lit_weights(table, pair.view, pair.light), planes));
    return entries;
}

std::string pairs_data(const BtfModel& model) {
    Bytes bytes;
    for (const BtfPair& pair : model.pairs) {
        append_word(bytes, pair.view);
        append_word(bytes, pair.light);
    }
    return base64(bytes);
}

Json angles_of(const std::vector<BtfDirection>& directions) {
    Json list = Json::array();
    for (const BtfDirection& direction : directions)
        list.push_back(Json::array({direction.theta, direction.phi}));
    return list;
}

std::string html_text(const std::string& text) {
    std::string result;
    for (const char c : text) {
        if (c == '<')
            result += "&lt;";
        else if (c == '&')
            result += "&amp;";
        else
            result += c;
    }
    return result;
}

/// Nothing in it ends a script element.
std::string script_json(const Json& object) {
    std::string result;
    for (const char c : object.dump(-1, ' ', false, Json::error_handler_t::replace)) {
        if (c == '<')
            result += "\\u003c";
        else
            result += c;
    }
    return result;
}

/// The page, each {{NAME}} being the text of that name.
std::string filled(std::string_view page, const Texts& texts) {
    std::string result;
    while (true) {
        const std::size_t from = page.find("{{"), to = page.find("}}", from);
        if (from == std::string_view::npos || to == std::string_view::npos) break;
        const std::string_view name = page.substr(from + 2, to - from - 2);
        const auto found = std::ranges::find(texts, name, &Texts::value_type::first);
        result += page.substr(0, from);
        if (found != texts.end()) result += found->second;
        page.remove_prefix(to + 2);
    }
    return result += page;
}

void check_request(const BtfModel& model, const Image& surface, const BtfPageOptions& options) {
    const std::string asked = "make a page of a BTF";
    if (model.colours != 1 && model.colours != 3)
        throw InputError(asked, "the model has " + counted(model.colours, "colour"),
                         "pages show one or three; btf render writes others as EXR");
    if (surface.planes() != model.planes() + 1)
        throw InputError(asked, "the surface has " + counted(surface.planes(), "plane"),
                         "give one that was grown of this model");
    if (options.planes < 0 || options.planes > model.planes())
        throw InputError(asked, counted(options.planes, "plane") + " are wanted",
                         "the model has " + std::to_string(model.planes()));
}

}  // namespace

std::string btf_page(const BtfModel& model, const BtfSynthesiser& grown, const BtfPageOptions& options) {
    check(model);
    const Image& surface = grown.surface();
    check_request(model, surface, options);
    const int planes = options.planes == 0 ? model.planes() : options.planes;
    const DirectionTable table(model, &seen_planes(grown));
    Json told;
    told["title"] = options.title;
    told["size"] = Json::array({surface.width(), surface.height()});
    told["planes"] = planes;
    told["colours"] = model.colours;
    told["space"] = name(model.space);
    told["background"] = 0.02;
    told["side"] = side;
    told["steepestView"] = table.measured().steepest_view();
    told["steepestLight"] = table.measured().steepest_light();
    told["views"] = angles_of(model.views);
    told["lights"] = angles_of(model.lights);
    Texts texts;
    texts.emplace_back("TITLE", html_text(options.title));
    texts.emplace_back("STYLE", page_text("view_page.css"));
    texts.emplace_back("FRAGMENT", page_text("view_page.glsl"));
    texts.emplace_back("TABLE_SCRIPT", page_text("view_table.js"));
    texts.emplace_back("PAINTER_SCRIPT", page_text("view_painter.js"));
    texts.emplace_back("CONTROLS_SCRIPT", page_text("view_controls.js"));
    texts.emplace_back("HEIGHT", height_data(surface, told));
    texts.emplace_back("PLANES", planes_data(surface, planes, told));
    if (!model.true_lights.empty()) told["trueLights"] = angles_of(model.true_lights);
    const auto kept = static_cast<std::size_t>(planes);
    add_table("LATTICE", direction_lattice(table, side, kept, options.progress).entries, model.white, kept,
              told["lattice"], texts);
    add_table("MEASURED", measured_entries(model, table, kept), model.white, kept, told["measured"], texts);
    texts.emplace_back("MEASURED_PAIRS", pairs_data(model));
    texts.emplace_back("MATERIAL", script_json(told));
    return filled(page_text("view_page.html"), texts);
}

}  // namespace btfield
