#pragma once

/// \file
/// Line plots as SVG inside an HTML page.

#include <string>
#include <vector>

namespace btfield::detail {

struct PlotLine {
    std::string name, colour;
    bool dashed = false;
    std::vector<double> values;  ///< one per position; NaN leaves a gap
};

/// Positions are at equal steps; the value axis begins at 0.
[[nodiscard]] std::string line_plot(const std::string& title, const std::string& x_title,
                                    const std::vector<std::string>& positions,
                                    const std::vector<PlotLine>& lines);

}  // namespace btfield::detail
