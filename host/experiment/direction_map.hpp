#pragma once

/// \file
/// Errors over the views and lights of BTFs, drawn on two discs: theta is the distance from the middle, 90
/// degrees the edge, phi the angle, counter-clockwise from the right.

#include <string>
#include <vector>

#include "btfield/btf_set.hpp"
#include "btfield/experiment.hpp"

namespace btfield::detail {

/// A value of one picture.
struct DirectedValue {
    ExperimentDirections at;
    double value = 0.0;  ///< NaN: none
};

struct DirectionMean {
    BtfDirection direction;
    double mean = 0.0;
    int pictures = 0;
};

/// Of each view the mean over its lights, or of each light that over its views; ring by ring. Directions
/// without values are left out.
[[nodiscard]] std::vector<DirectionMean> means_over_lights(const std::vector<DirectedValue>& values);
[[nodiscard]] std::vector<DirectionMean> means_over_views(const std::vector<DirectedValue>& values);

/// From value to colour. Logarithmic: the least above 0, else 0, and the largest.
struct MapScale {
    double low = 0.0, high = 0.0;
    bool logarithmic = false;
    [[nodiscard]] double share(double value) const;
};
/// Of all means that both discs of each of these maps show.
[[nodiscard]] MapScale map_scale(const std::vector<std::vector<DirectedValue>>& maps, bool logarithmic);

/// SVG: two discs and what the colours mean. Nothing where no value is.
/// \param unit follows numbers: " %"
[[nodiscard]] std::string direction_map(const std::string& title, const std::string& unit,
                                        const std::vector<DirectedValue>& values, const MapScale& scale);

/// HTML: maps of κ, and of MEMD* and of the deviation's error of each model, of all materials that are BTFs;
/// nothing where there is none. Maps of one thing have one scale.
/// \param table with its picture_rows
[[nodiscard]] std::string direction_maps_html(const ExperimentTable& table);

}  // namespace btfield::detail
