#include "host/experiment/direction_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <utility>

#include "host/base/text.hpp"
#include "host/experiment/angles.hpp"
#include "host/experiment/table_format.hpp"

namespace btfield::detail {
namespace {

constexpr double map_width = 420.0, map_height = 236.0;
constexpr double disc_radius = 84.0;  // of 90 degrees
constexpr double disc_y = 136.0, views_x = 92.0, lights_x = 276.0;
constexpr double bar_x = 378.0, bar_width = 10.0;

std::string fixed(double value) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.6g", std::round(value * 100.0) / 100.0);
    return text.data();
}

/// Three digits.
std::string short_text(double value) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.3g", value);
    return text.data();
}

/// Dark to light, of even steps in lightness, told apart by those who see few colours.
std::string shade(double share) {
    constexpr std::array<std::array<double, 3>, 5> stops{
        {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}}};
    const double at = std::clamp(share, 0.0, 1.0) * (stops.size() - 1);
    const auto below = std::min(static_cast<std::size_t>(at), stops.size() - 2);
    const double part = at - static_cast<double>(below);
    std::array<int, 3> mixed{};
    for (std::size_t c = 0; c < 3; ++c)
        mixed[c] = static_cast<int>(std::lround((1.0 - part) * stops[below][c] + part * stops[below + 1][c]));
    std::array<char, 8> text{};
    std::snprintf(text.data(), text.size(), "#%02x%02x%02x", static_cast<unsigned>(mixed[0]) & 255U,
                  static_cast<unsigned>(mixed[1]) & 255U, static_cast<unsigned>(mixed[2]) & 255U);
    return text.data();
}

std::vector<DirectionMean> means_by(const std::vector<DirectedValue>& values,
                                    BtfDirection ExperimentDirections::*which) {
    // Directions of one set are equal to the last bit, but those of several may differ by rounding.
    std::map<std::pair<long, long>, DirectionMean> means;
    for (const DirectedValue& value : values) {
        if (!std::isfinite(value.value)) continue;
        const BtfDirection direction = within_a_turn(value.at.*which);
        const std::pair key{std::lround(in_degrees(direction.theta) * 100.0),
                            std::lround(in_degrees(direction.phi) * 100.0) % 36000};
        DirectionMean& mean = means[key];
        mean.direction = direction;
        mean.mean += value.value;
        ++mean.pictures;
    }
    std::vector<DirectionMean> all;
    for (auto& entry : means) {
        all.push_back(entry.second);
        all.back().mean /= all.back().pictures;
    }
    return all;
}

std::pair<double, double> place_on(double centre_x, const BtfDirection& direction) {
    const double radius = disc_radius * in_degrees(direction.theta) / 90.0;
    return {centre_x + radius * std::cos(direction.phi), disc_y - radius * std::sin(direction.phi)};
}

/// So large that dots nearly touch.
double dot_radius(double centre_x, const std::vector<DirectionMean>& means) {
    double nearest = 2.0 * disc_radius;
    for (std::size_t i = 0; i < means.size(); ++i) {
        for (std::size_t k = 0; k < i; ++k) {
            const auto a = place_on(centre_x, means[i].direction), b = place_on(centre_x, means[k].direction);
            nearest = std::min(nearest, std::hypot(a.first - b.first, a.second - b.second));
        }
    }
    return std::clamp(0.48 * nearest, 2.0, 7.0);
}

std::string label(double x, double y, const char* anchor, const std::string& text) {
    return "<text x=\"" + fixed(x) + "\" y=\"" + fixed(y) + "\" text-anchor=\"" + anchor + "\">" +
           html_text(text) + "</text>";
}

std::string disc(double centre_x, const std::string& name, const std::string& unit,
                 const std::vector<DirectionMean>& means, const MapScale& scale) {
    std::string svg = "<g class=\"disc\">";
    for (const double theta : {30.0, 60.0, 90.0})
        svg += "<circle cx=\"" + fixed(centre_x) + "\" cy=\"" + fixed(disc_y) + "\" r=\"" +
               fixed(disc_radius * theta / 90.0) + "\"/>";
    svg += "</g>" + label(centre_x, 40.0, "middle", name);
    const std::string radius = fixed(dot_radius(centre_x, means));
    for (const DirectionMean& mean : means) {
        const auto [x, y] = place_on(centre_x, mean.direction);
        svg += "<circle cx=\"" + fixed(x) + "\" cy=\"" + fixed(y) + "\" r=\"" + radius + "\" fill=\"" +
               shade(scale.share(mean.mean)) + "\"><title>" + html_text(angles_text(mean.direction)) + ": " +
               short_text(mean.mean) + html_text(unit) + ", " + counted(mean.pictures, "picture") +
               "</title></circle>";
    }
    return svg;
}

std::string colour_bar(const MapScale& scale, const std::string& unit) {
    constexpr int steps = 24;
    const double top = disc_y - disc_radius, step = 2.0 * disc_radius / steps;
    std::string svg = "<g>";
    for (int i = 0; i < steps; ++i)
        svg += "<rect x=\"" + fixed(bar_x) + "\" y=\"" + fixed(top + i * step) + "\" width=\"" +
               fixed(bar_width) + "\" height=\"" + fixed(step + 0.3) + "\" fill=\"" +
               shade(1.0 - (i + 0.5) / steps) + "\"/>";
    return svg + "</g>" + label(bar_x + bar_width, top - 5.0, "end", short_text(scale.high) + unit) +
           label(bar_x + bar_width, disc_y + disc_radius + 13.0, "end", short_text(scale.low) + unit);
}

/// The rows of a material that are pictures of BTFs, with one value of each.
template <class Value>
std::vector<DirectedValue> values_of_rows(const std::vector<const ExperimentTable::PictureRow*>& rows,
                                          const Value& value) {
    std::vector<DirectedValue> values;
    values.reserve(rows.size());
    for (const ExperimentTable::PictureRow* row : rows) values.push_back({*row->directions, value(*row)});
    return values;
}

}  // namespace

std::vector<DirectionMean> means_over_lights(const std::vector<DirectedValue>& values) {
    return means_by(values, &ExperimentDirections::view);
}

std::vector<DirectionMean> means_over_views(const std::vector<DirectedValue>& values) {
    return means_by(values, &ExperimentDirections::light);
}

double MapScale::share(double value) const {
    if (!logarithmic) return high > low ? (value - low) / (high - low) : 0.0;
    if (!(value > 0.0)) return 0.0;
    return high > low ? std::log(value / low) / std::log(high / low) : 0.0;
}

MapScale map_scale(const std::vector<std::vector<DirectedValue>>& maps, bool logarithmic) {
    MapScale scale{std::numeric_limits<double>::infinity(), 0.0, logarithmic};
    for (const std::vector<DirectedValue>& values : maps)
        for (const auto& means : {means_over_lights(values), means_over_views(values)})
            for (const DirectionMean& mean : means) {
                scale.high = std::max(scale.high, mean.mean);
                if (mean.mean > 0.0) scale.low = std::min(scale.low, mean.mean);
            }
    if (!logarithmic || !std::isfinite(scale.low)) scale.low = 0.0;
    if (!(scale.low > 0.0)) scale.logarithmic = false;
    return scale;
}

std::string direction_map(const std::string& title, const std::string& unit,
                          const std::vector<DirectedValue>& values, const MapScale& scale) {
    const std::vector<DirectionMean> views = means_over_lights(values), lights = means_over_views(values);
    if (views.empty()) return {};
    return "<svg viewBox=\"0 0 " + fixed(map_width) + " " + fixed(map_height) + "\" role=\"img\"><title>" +
           html_text(title) + "</title><g class=\"title\">" + label(8.0, 16.0, "start", title) + "</g>" +
           disc(views_x, "views", unit, views, scale) + disc(lights_x, "lights", unit, lights, scale) +
           colour_bar(scale, unit) + "</svg>\n";
}

std::string direction_maps_html(const ExperimentTable& table) {
    /// Of a material: MEMD* and the deviation's error of each model, and κ.
    struct Maps {
        std::string material;
        std::size_t pictures = 0;
        std::vector<std::vector<DirectedValue>> memd, deviation, kappa;
    };
    std::vector<Maps> all;
    std::vector<std::vector<DirectedValue>> memd, deviation, kappa;
    for (const std::string& material : table.materials) {
        std::vector<const ExperimentTable::PictureRow*> rows;
        for (const ExperimentTable::PictureRow& row : table.picture_rows)
            if (row.material == material && row.directions) rows.push_back(&row);
        if (rows.empty()) continue;
        Maps maps{material, rows.size(), {}, {}, {}};
        for (std::size_t m = 0; m < table.rows.size(); ++m) {
            maps.memd.push_back(values_of_rows(rows, [&](const auto& row) { return row.best[m]; }));
            maps.deviation.push_back(values_of_rows(
                rows, [&](const auto& row) { return 100.0 * std::abs(row.std_ratio[m] - 1.0); }));
        }
        maps.kappa.push_back(values_of_rows(rows, [](const auto& row) { return row.kappa; }));
        memd.insert(memd.end(), maps.memd.begin(), maps.memd.end());
        deviation.insert(deviation.end(), maps.deviation.begin(), maps.deviation.end());
        kappa.insert(kappa.end(), maps.kappa.begin(), maps.kappa.end());
        all.push_back(std::move(maps));
    }
    const MapScale of_memd = map_scale(memd, false), of_deviation = map_scale(deviation, false),
                   of_kappa = map_scale(kappa, true);
    std::string html;
    for (const Maps& maps : all) {
        html += "<h3>" + html_text(maps.material) + " by view and light</h3>\n<p>" +
                counted(maps.pictures, "picture") +
                ". The middle of a disc is above the surface, its edge 90 degrees from there, phi goes "
                "counter-clockwise from the right. Of a view the mean over its lights, of a light over its "
                "views. Colours mean the same in all maps of MEMD*, of all models and materials, and so they "
                "do in "
                "those of deviations and of κ.</p>\n<div class=\"plots\">\n";
        for (std::size_t m = 0; m < table.rows.size(); ++m) {
            const std::string model = model_title(table.rows[m].model);
            html += direction_map(model + ": MEMD*, %", " %", maps.memd[m], of_memd) +
                    direction_map(model + ": standard deviation off by, %", " %", maps.deviation[m],
                                  of_deviation);
        }
        html += direction_map("κ(256), logarithmic", "", maps.kappa.front(), of_kappa) + "</div>\n";
    }
    return html;
}

}  // namespace btfield::detail
