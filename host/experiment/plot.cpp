#include "host/experiment/plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "host/base/text.hpp"

namespace btfield::detail {
namespace {

constexpr double width = 420.0, height = 260.0;
constexpr double left = 44.0, right = 12.0, top = 30.0, bottom = 40.0;

std::string number(double value) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.6g", std::round(value * 100.0) / 100.0);
    return text.data();
}

/// 1, 2 or 5 times a power of ten: about five steps to the highest value.
double step_for(double highest) {
    const double rough = highest / 5.0, power = std::pow(10.0, std::floor(std::log10(rough)));
    for (const double step : {1.0, 2.0, 5.0}) {
        if (rough <= step * power) return step * power;
    }
    return 10.0 * power;
}

std::string text_at(double x, double y, const char* anchor, const std::string& text) {
    return "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" text-anchor=\"" + anchor + "\">" +
           html_text(text) + "</text>";
}

}  // namespace

std::string line_plot(const std::string& title, const std::string& x_title,
                      const std::vector<std::string>& positions, const std::vector<PlotLine>& lines) {
    double highest = 0.0;
    for (const PlotLine& line : lines) {
        for (const double value : line.values) {
            if (std::isfinite(value)) highest = std::max(highest, value);
        }
    }
    if (highest <= 0.0) highest = 1.0;
    const double step = step_for(highest), ceiling = step * std::ceil(highest / step);
    const auto x = [&](std::size_t i) {
        const double inner = width - left - right;
        return positions.size() < 2 ? left + inner / 2.0
                                    : left + inner * (0.05 + 0.9 * static_cast<double>(i) /
                                                                 static_cast<double>(positions.size() - 1));
    };
    const auto y = [&](double value) { return height - bottom - (height - top - bottom) * value / ceiling; };

    std::string svg = "<svg viewBox=\"0 0 " + number(width) + " " + number(height) +
                      "\" role=\"img\"><title>" + html_text(title) + "</title>";
    svg += "<g class=\"title\">" + text_at(left, 16.0, "start", title) + "</g><g class=\"axis\">";
    for (int i = 0; i * step <= ceiling * (1.0 + 1e-9); ++i) {
        const double at = y(i * step);
        svg += "<line x1=\"" + number(left) + "\" x2=\"" + number(width - right) + "\" y1=\"" + number(at) +
               "\" y2=\"" + number(at) + "\"/>" + text_at(left - 6.0, at + 4.0, "end", number(i * step));
    }
    for (std::size_t i = 0; i < positions.size(); ++i) {
        svg += text_at(x(i), height - bottom + 16.0, "middle", positions[i]);
    }
    svg += text_at((left + width - right) / 2.0, height - 6.0, "middle", x_title) + "</g>";
    for (const PlotLine& line : lines) {
        std::string path, dots;
        bool pen_down = false;
        for (std::size_t i = 0; i < line.values.size(); ++i) {
            if (!std::isfinite(line.values[i])) {
                pen_down = false;
                continue;
            }
            const std::string place = number(x(i)) + " " + number(y(line.values[i]));
            path += (pen_down ? "L" : "M") + place;
            dots +=
                "<circle cx=\"" + number(x(i)) + "\" cy=\"" + number(y(line.values[i])) + "\" r=\"2.5\"/>";
            pen_down = true;
        }
        if (path.empty()) continue;
        svg += "<g stroke=\"" + line.colour + "\" fill=\"" + line.colour + "\"><title>" +
               html_text(line.name) + "</title><path fill=\"none\" stroke-width=\"1.8\"" +
               (line.dashed ? " stroke-dasharray=\"5 3\"" : "") + " d=\"" + path + "\"/>" + dots + "</g>";
    }
    return svg + "</svg>";
}

}  // namespace btfield::detail
