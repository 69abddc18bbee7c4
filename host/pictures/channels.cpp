#include "host/pictures/channels.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstddef>
#include <map>
#include <numeric>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/pictures/colour.hpp"

namespace btfield::detail {
namespace {

using Texts = std::vector<std::string>;

std::string lower(std::string_view text) {
    std::string result(text);
    for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return result;
}

/// The name behind its layers, and the layers.
struct Split {
    std::string_view layer, last;
};

Split split(std::string_view name) {
    const std::size_t dot = name.rfind('.');
    if (dot == std::string_view::npos) return {{}, name};
    return {name.substr(0, dot), name.substr(dot + 1)};
}

bool has_channel(const Texts& names, std::string_view layer, std::string_view last) {
    return std::ranges::any_of(names, [&](const std::string& name) {
        const Split parts = split(name);
        return parts.layer == layer && lower(parts.last) == last;
    });
}

bool is_alpha(const Texts& names, std::size_t channel);

/// 'R', 'G', 'B', 'X', 'Y' or 'Z', and what stands before it; 0 for other names.
std::pair<std::string_view, char> role_of(std::string_view name) {
    static constexpr std::array<std::pair<std::string_view, char>, 3> words{
        {{"red", 'R'}, {"green", 'G'}, {"blue", 'B'}}};
    const Split parts = split(name);
    for (const auto& [word, role] : words)
        if (lower(parts.last) == word) return {parts.layer, role};
    if (name.empty()) return {name, '\0'};
    const std::string_view before = name.substr(0, name.size() - 1);
    const char letter = name.back();
    const bool alone = parts.last.size() == 1;
    const char role = alone ? static_cast<char>(std::toupper(static_cast<unsigned char>(letter))) : letter;
    const bool known = std::string_view("RGB").find(role) != std::string_view::npos ||
                       (alone && std::string_view("XYZ").find(role) != std::string_view::npos);
    return {before, known ? role : '\0'};
}

/// Whether a channel beside which an alpha stands is something that light has: red, grey, a wavelength, a
/// band with its number. Blue or green alone may be a letter like any other.
bool is_light(const std::string& name) {
    const std::string last = lower(split(name).last);
    const bool numbered = last.size() > 1 && std::isdigit(static_cast<unsigned char>(last.back())) != 0;
    if (numbered || wavelength_of(name)) return true;
    const char role = role_of(name).second;
    return role == 'R' || role == 'Y' || last == "l" || last == "luminance";
}

/// A layer's alpha stands beside its colours; that of the whole picture, A, beside layers of colours. Among
/// letters and words of other kinds, a, b and c, it is data.
bool is_alpha(const Texts& names, std::size_t channel) {
    const Split parts = split(names[channel]);
    const std::string last = lower(parts.last);
    const bool coloured = last == "ar" || last == "ag" || last == "ab";
    if (coloured) return has_channel(names, parts.layer, last.substr(1));
    if (last == "alpha") return names.size() > 1 && !has_channel(names, parts.layer, "beta");
    if (last != "a") return false;
    const bool lab = has_channel(names, parts.layer, "l") && has_channel(names, parts.layer, "b") &&
                     !has_channel(names, parts.layer, "r");
    const bool whole = parts.layer.empty() && names[channel] == "A";
    return !lab && std::ranges::any_of(names, [&](const std::string& name) {
        return (split(name).layer == parts.layer || whole) && is_light(name);
    });
}

/// Planes in the order of `letters` when their names are these, all behind the same text.
std::optional<std::vector<int>> as_colours(const Texts& names, const std::vector<int>& planes,
                                           std::string_view letters) {
    if (planes.size() != 3) return std::nullopt;
    std::vector<int> ordered(3, -1);
    const std::string_view prefix = role_of(names[static_cast<std::size_t>(planes[0])]).first;
    for (const int channel : planes) {
        const auto [before, role] = role_of(names[static_cast<std::size_t>(channel)]);
        const std::size_t place = role == '\0' ? std::string_view::npos : letters.find(role);
        if (place == std::string_view::npos || before != prefix || ordered[place] >= 0) return std::nullopt;
        ordered[place] = channel;
    }
    return ordered;
}

/// Whether a layer's name, with its full stop, says that its R, G and B are no colours.
bool holds_data(std::string_view before) {
    while (before.ends_with('.')) before.remove_suffix(1);
    static constexpr std::array<std::string_view, 23> words{
        "n",     "normal",    "normals",   "nor",          "nrm",       "p",       "position", "pos",
        "depth", "height",    "disp",      "displacement", "bump",      "motion",  "velocity", "vector",
        "uv",    "roughness", "metalness", "metallic",     "occlusion", "opacity", "id"};
    return std::ranges::find(words, lower(split(before).last)) != words.end();
}

/// Names that every nameless picture of so many planes gets in a file.
bool say_nothing(const Texts& names) {
    if (names == Texts{"R", "G", "B"} || names == Texts{"X", "Y", "Z"} || names == Texts{"Y"}) return true;
    for (std::size_t i = 0; i < names.size(); ++i) {
        std::string_view name = names[i];
        if (!name.starts_with("plane")) return false;
        name.remove_prefix(5);
        std::size_t number = 0;
        const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
        if (error != std::errc() || end != name.data() + name.size() || number != i) return false;
    }
    return true;
}

/// Channels that one word of `chosen` stands for.
std::vector<int> matching(const Texts& names, const std::string& wanted) {
    std::vector<int> found;
    for (std::size_t c = 0; c < names.size(); ++c)
        if (names[c] == wanted) found.push_back(static_cast<int>(c));
    if (!found.empty()) return found;
    for (std::size_t c = 0; c < names.size(); ++c)
        if (split(names[c]).layer == wanted && !is_alpha(names, c)) found.push_back(static_cast<int>(c));
    if (!found.empty()) return found;
    std::size_t number = 0;
    const auto [end, error] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), number);
    if (error == std::errc() && end == wanted.data() + wanted.size() && number < names.size())
        found.push_back(static_cast<int>(number));
    return found;
}

std::vector<int> chosen_planes(const Texts& names, const Texts& chosen, const std::string& asked) {
    std::vector<int> planes;
    for (const std::string& wanted : chosen) {
        const std::vector<int> found = matching(names, wanted);
        if (found.empty()) {
            std::string list;
            constexpr std::size_t most = 40;
            for (std::size_t c = 0; c < names.size() && c < most; ++c)
                list += (c > 0 ? ", " : "") + valid_utf8(names[c]);
            if (names.size() > most) list += ", ...";
            throw InputError(
                asked, "it has no plane '" + wanted + "'",
                "choose from " + list + ", or by number from 0 to " + std::to_string(names.size() - 1));
        }
        for (const int channel : found) {
            if (std::ranges::find(planes, channel) != planes.end())
                throw InputError(
                    asked,
                    "plane '" + valid_utf8(names[static_cast<std::size_t>(channel)]) + "' is asked for twice",
                    "name each plane once");
            planes.push_back(channel);
        }
    }
    return planes;
}

/// Those that are wavelengths, in their places, ascending within what stands before the number.
void sort_wavelengths(const Texts& names, std::vector<int>& planes) {
    std::vector<std::size_t> places;
    std::vector<int> waves;
    for (std::size_t p = 0; p < planes.size(); ++p) {
        if (!wavelength_of(names[static_cast<std::size_t>(planes[p])])) continue;
        places.push_back(p);
        waves.push_back(planes[p]);
    }
    const auto key = [&](int channel) {
        const std::string& name = names[static_cast<std::size_t>(channel)];
        // Stokes components "S0.", "S1." and the like stay together.
        const std::string_view prefix = std::string_view(name).substr(0, name.find('.'));
        const bool component = prefix.size() == 2 && prefix[0] == 'S';
        return std::pair(component ? std::string(prefix) : std::string(), wavelength_of(name).value());
    };
    std::ranges::stable_sort(waves, [&](int a, int b) { return key(a) < key(b); });
    for (std::size_t i = 0; i < places.size(); ++i) planes[places[i]] = waves[i];
}

}  // namespace

std::string kind_of_name(std::string_view name) {
    if (wavelength_of(name)) return "nm";
    const auto [before, role] = role_of(name);
    if (role == '\0') return {};
    return std::string(before) +
           (std::string_view("RGB").find(role) != std::string_view::npos ? "RGB" : "XYZ");
}

std::vector<std::array<int, 3>> colour_layers(const std::vector<std::string>& names) {
    std::map<std::string, std::array<int, 3>> layers;
    for (std::size_t n = 0; n < names.size(); ++n) {
        const auto [before, role] = role_of(names[n]);
        const std::size_t place = std::string_view("RGB").find(role);
        if (role == '\0' || place == std::string_view::npos) continue;
        layers.try_emplace(std::string(before), std::array{-1, -1, -1}).first->second.at(place) =
            static_cast<int>(n);
    }
    std::vector<std::array<int, 3>> whole;
    for (const auto& [before, planes] : layers)
        if (!holds_data(before) && std::ranges::none_of(planes, [](int plane) { return plane < 0; }))
            whole.push_back(planes);
    return whole;
}

std::vector<ColourSpace> spaces_of_channels(const std::vector<std::string>& names) {
    std::vector<ColourSpace> spaces(names.size(), ColourSpace::unspecified);
    for (const std::array<int, 3>& layer : colour_layers(names))
        for (const int channel : layer) spaces[static_cast<std::size_t>(channel)] = ColourSpace::linear;
    const auto at = [&](std::string_view name) {
        return static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
    };
    const std::size_t x = at("X"), y = at("Y"), z = at("Z");
    if (x < names.size() && y < names.size() && z < names.size())
        spaces[x] = spaces[y] = spaces[z] = ColourSpace::xyz;
    else if (y < names.size() && x == names.size())
        spaces[y] = ColourSpace::linear;
    return spaces;
}

std::optional<double> wavelength_of(std::string_view name) {
    std::string text = lower(name);
    double unit = 0.0;
    for (const auto& [suffix, factor] : {std::pair<std::string_view, double>{"nm", 1.0},
                                         {"\xc2\xb5m", 1000.0},
                                         {"\xce\xbcm", 1000.0},
                                         {"um", 1000.0}}) {
        if (!text.ends_with(suffix)) continue;
        unit = factor;
        text.resize(text.size() - suffix.size());
        break;
    }
    while (!text.empty() && (text.back() == ' ' || text.back() == '_')) text.pop_back();
    std::size_t start = text.size();
    const auto belongs = [](char c) {
        return std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '.' || c == ',';
    };
    while (start > 0 && belongs(text[start - 1])) --start;
    while (start < text.size() && std::isdigit(static_cast<unsigned char>(text[start])) == 0) ++start;
    std::string digits = text.substr(start);
    // "S0.450nm": what stands before the full stop is the end of a layer's name.
    const std::size_t stop = digits.find('.');
    if (stop < 3 && start > 0 && std::isalpha(static_cast<unsigned char>(text[start - 1])) != 0) {
        start += stop + 1;
        digits.erase(0, stop + 1);
    }
    // "S0.450,5nm": the decimal sign is a comma there.
    if (const std::size_t comma = digits.find(','); comma != std::string::npos) {
        if (digits.find('.') != std::string::npos) return std::nullopt;
        digits[comma] = '.';
    }
    double number = 0.0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    if (digits.empty() || error != std::errc() || end != digits.data() + digits.size()) return std::nullopt;
    std::string_view before = std::string_view(text).substr(0, start);
    while (!before.empty() && (before.back() == '_' || before.back() == ' ' || before.back() == '-'))
        before.remove_suffix(1);
    if (unit == 0.0) {
        constexpr std::array<std::string_view, 7> words{"",         "w",          "wl",  "lambda",
                                                        "\xce\xbb", "wavelength", "wave"};
        const bool known = std::ranges::find(words, split(before).last) != words.end();
        if (!known || number < 100.0 || number > 20000.0) return std::nullopt;
        unit = 1.0;
    }
    return number * unit;
}

Texts channel_names(int count) {
    if (count <= 2) return count == 1 ? Texts{"Y"} : Texts{"Y", "A"};
    Texts names{"R", "G", "B"};
    if (count == 4) names.emplace_back("A");
    for (int c = static_cast<int>(names.size()); c < count; ++c)
        names.push_back("channel" + std::to_string(c));
    return names;
}

void keep_planes(Picture& picture, const ChannelPlan& plan) {
    std::vector<int> same(static_cast<std::size_t>(picture.image.planes()));
    std::iota(same.begin(), same.end(), 0);
    if (plan.planes == same) return;
    const int count = static_cast<int>(plan.planes.size());
    const bool colour = count == 3 && picture.image.planes() == 3;
    std::vector<ColourSpace> spaces;
    spaces.reserve(static_cast<std::size_t>(picture.image.planes()));
    for (int p = 0; p < picture.image.planes(); ++p) spaces.push_back(picture.image.plane_space(p));
    Image kept(picture.image.size(), count, colour ? picture.image.space() : ColourSpace::unspecified);
    if (!colour) kept.set_plane_spaces(spaces_of(spaces, plan.planes));
    for (int p = 0; p < count; ++p)
        std::ranges::copy(picture.image.plane(plan.planes[static_cast<std::size_t>(p)]),
                          kept.plane(p).begin());
    picture.image = std::move(kept);
}

ChannelPlan plan_channels(const Texts& names, const Texts& chosen, int alpha, const std::string& asked) {
    ChannelPlan plan;
    for (std::size_t c = 0; c < names.size(); ++c) {
        const bool aside = names.size() > 1 && (static_cast<int>(c) == alpha || is_alpha(names, c));
        (aside ? plan.alpha : plan.planes).push_back(static_cast<int>(c));
    }
    if (plan.planes.empty()) std::swap(plan.planes, plan.alpha);
    if (!chosen.empty()) {
        plan.planes = chosen_planes(names, chosen, asked);
        std::erase_if(plan.alpha,
                      [&](int c) { return std::ranges::find(plan.planes, c) != plan.planes.end(); });
    }
    const auto rgb = as_colours(names, plan.planes, "RGB");
    const auto xyz = as_colours(names, plan.planes, "XYZ");
    if (rgb && (chosen.empty() || *rgb == plan.planes || chosen.size() == 1)) {
        plan.colours = ColourSpace::linear;
        plan.planes = *rgb;
    } else if (xyz && (chosen.empty() || *xyz == plan.planes || chosen.size() == 1)) {
        // Normals and positions have layers of these names.
        const std::string layer = lower(split(names[static_cast<std::size_t>(xyz->front())]).layer);
        if (layer.empty() || layer.find("xyz") != std::string::npos) plan.colours = ColourSpace::xyz;
        plan.planes = *xyz;
    } else if (chosen.empty()) {
        sort_wavelengths(names, plan.planes);
    }
    for (const int channel : plan.planes)
        plan.names.push_back(valid_utf8(names[static_cast<std::size_t>(channel)]));
    if (say_nothing(plan.names)) plan.names.clear();
    return plan;
}

}  // namespace btfield::detail
