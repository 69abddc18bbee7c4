#include "host/cli/curve_plot.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <vector>

#include "host/base/text.hpp"

namespace btfield::cli {
namespace {

constexpr double chart_width = 300.0, chart_height = 180.0;
constexpr double left = 52.0, top = 30.0, gap = 72.0, below = 64.0;
constexpr const char* colour_a = "#1f4e9c";
constexpr const char* colour_b = "#d1601f";

std::string short_number(double value) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.4g", value);
    return text.data();
}

std::string place_text(double value) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.2f", value);
    return text.data();
}

struct Point {
    double x = 0.0, y = 0.0;
};

/// One line of a chart.
struct Curve {
    std::vector<Point> points;
    const char* colour = colour_a;
    bool dashed = false;
};

/// From values to a side of the chart.
struct Axis {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    bool logarithmic = false;

    void take(double value) {
        if (!std::isfinite(value) || (logarithmic && !(value > 0.0))) return;
        low = std::min(low, value);
        high = std::max(high, value);
    }
    /// An axis without values or of one has a width all the same.
    void widen() {
        if (!(low <= high)) low = high = 1.0;
        if (low == high) {
            low = logarithmic ? low / 2.0 : low - 0.5;
            high = logarithmic ? high * 2.0 : high + 0.5;
        }
    }
    /// 0 at low, 1 at high.
    [[nodiscard]] double place(double value) const {
        const auto scaled = [&](double v) { return logarithmic ? std::log(v) : v; };
        return (scaled(value) - scaled(low)) / (scaled(high) - scaled(low));
    }
    [[nodiscard]] bool shows(double value) const {
        return std::isfinite(value) && (!logarithmic || value > 0.0);
    }
};

std::string text_at(double x, double y, const char* anchor, const std::string& text) {
    return "<text x=\"" + place_text(x) + "\" y=\"" + place_text(y) + "\" text-anchor=\"" + anchor + "\">" +
           detail::html_text(text) + "</text>\n";
}

std::string path_of(const Curve& curve, const Axis& x, const Axis& y) {
    std::string d;
    bool pen_down = false;
    for (const Point& point : curve.points) {
        if (!x.shows(point.x) || !y.shows(point.y)) {
            pen_down = false;
            continue;
        }
        d += (pen_down ? "L" : "M") + place_text(chart_width * x.place(point.x)) + " " +
             place_text(chart_height * (1.0 - y.place(point.y)));
        pen_down = true;
    }
    return "<path fill=\"none\" stroke=\"" + std::string(curve.colour) + "\" stroke-width=\"1.6\"" +
           (curve.dashed ? " stroke-dasharray=\"5 3\"" : "") + " d=\"" + d + "\"/>\n";
}

struct Chart {
    std::string title, across;
    Axis x, y;
    std::vector<Curve> curves;
};

std::string chart_text(Chart chart, double at_x, double at_y) {
    for (const Curve& curve : chart.curves)
        for (const Point& point : curve.points) {
            chart.x.take(point.x);
            chart.y.take(point.y);
        }
    chart.x.widen();
    chart.y.widen();
    std::string text = "<g transform=\"translate(" + place_text(at_x) + " " + place_text(at_y) + ")\">\n" +
                       "<rect width=\"" + place_text(chart_width) + "\" height=\"" +
                       place_text(chart_height) + "\" fill=\"none\" stroke=\"#999\"/>\n";
    text += text_at(0.0, -8.0, "start", chart.title);
    text += text_at(0.0, chart_height + 15.0, "start", short_number(chart.x.low));
    text += text_at(chart_width, chart_height + 15.0, "end", short_number(chart.x.high));
    text += text_at(chart_width / 2.0, chart_height + 15.0, "middle", chart.across);
    text += text_at(-5.0, chart_height, "end", short_number(chart.y.low));
    text += text_at(-5.0, 10.0, "end", short_number(chart.y.high));
    if (!chart.y.logarithmic && chart.y.low < 0.0 && chart.y.high > 0.0) {
        const std::string zero = place_text(chart_height * (1.0 - chart.y.place(0.0)));
        text += "<path stroke=\"#ccc\" d=\"M0 " + zero + "H" + place_text(chart_width) + "\"/>\n";
    }
    for (const Curve& curve : chart.curves) text += path_of(curve, chart.x, chart.y);
    return text + "</g>\n";
}

/// Along rows and, dashed, along columns.
Chart covariance_chart(const StatisticCurves& curves, const StatisticCurves::Plane& plane) {
    Chart chart{"covariance / variance of A", "lag: along rows, dashed along columns", {}, {}, {}};
    for (const bool columns : {false, true})
        for (const std::size_t which : {0U, 1U}) {
            Curve& curve = chart.curves.emplace_back();
            curve.colour = which == 0 ? colour_a : colour_b;
            curve.dashed = columns;
            for (std::size_t s = 0; s < curves.lags.size(); ++s) {
                const auto [row, column] = curves.lags[s];
                if ((columns ? column : row) != 0) continue;
                curve.points.push_back(
                    {static_cast<double>(columns ? row : column), plane.covariance[s][which]});
            }
        }
    return chart;
}

Chart spectrum_chart(const StatisticCurves& curves, const StatisticCurves::Plane& plane) {
    Chart chart{"power spectrum / variance of A", "cycles per pixel", {}, {}, {}};
    chart.x.logarithmic = chart.y.logarithmic = true;
    for (const std::size_t which : {0U, 1U}) {
        Curve& curve = chart.curves.emplace_back();
        curve.colour = which == 0 ? colour_a : colour_b;
        for (std::size_t k = 0; k < curves.frequencies.size(); ++k)
            curve.points.push_back({curves.frequencies[k], plane.spectrum[k][which]});
    }
    return chart;
}

Chart histogram_chart(const StatisticCurves::Plane& plane) {
    Chart chart{"histogram, share of pixels", "value", {}, {}, {}};
    chart.y.take(0.0);
    for (const std::size_t which : {0U, 1U}) {
        Curve& curve = chart.curves.emplace_back();
        curve.colour = which == 0 ? colour_a : colour_b;
        for (std::size_t k = 0; k < plane.histogram.size(); ++k) {
            curve.points.push_back({plane.edges[k], plane.histogram[k][which]});
            curve.points.push_back({plane.edges[k + 1], plane.histogram[k][which]});
        }
    }
    return chart;
}

std::string legend(double y, const PlottedPair& pair) {
    std::string text;
    double x = left;
    for (const std::size_t which : {0U, 1U}) {
        std::string name = detail::valid_utf8(pair.names[which]);
        // XML has no control characters.
        std::ranges::replace_if(
            name, [](char c) { return static_cast<unsigned char>(c) < 32; }, ' ');
        text += "<path stroke=\"" + std::string(which == 0 ? colour_a : colour_b) +
                "\" stroke-width=\"3\" d=\"M" + place_text(x) + " " + place_text(y - 4.0) + "h24\"/>\n" +
                text_at(x + 30.0, y, "start", (which == 0 ? "A: " : "B: ") + name);
        x += 1.5 * (chart_width + gap);
    }
    return text;
}

}  // namespace

std::string curves_svg(std::span<const PlottedPair> pairs) {
    std::string body;
    double y = 24.0;
    for (const PlottedPair& pair : pairs) {
        body += legend(y, pair);
        y += top;
        for (std::size_t p = 0; p < pair.curves.planes.size(); ++p) {
            const StatisticCurves::Plane& plane = pair.curves.planes[p];
            const std::array charts{covariance_chart(pair.curves, plane), spectrum_chart(pair.curves, plane),
                                    histogram_chart(plane)};
            double x = left;
            for (const Chart& chart : charts) {
                body += chart_text(chart, x, y + 12.0);
                x += chart_width + gap;
            }
            body += text_at(left, y - 10.0, "start", "plane " + std::to_string(p));
            y += chart_height + below;
        }
        y += 12.0;
    }
    const double width = left + 3.0 * chart_width + 2.0 * gap + 16.0;
    return "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + place_text(width) + "\" height=\"" +
           place_text(y) + "\" viewBox=\"0 0 " + place_text(width) + " " + place_text(y) +
           "\" font-family=\"sans-serif\" font-size=\"11\">\n<rect width=\"100%\" height=\"100%\" "
           "fill=\"white\"/>\n" +
           body + "</svg>\n";
}

std::string curves_page(std::span<const PlottedPair> pairs) {
    return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>btfield compare</title>"
           "</head><body>\n" +
           curves_svg(pairs) + "</body></html>\n";
}

}  // namespace btfield::cli
