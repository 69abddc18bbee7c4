#pragma once

/// \file
/// The statistics of two pictures as a page of charts.

#include <array>
#include <span>
#include <string>

#include "btfield/curves.hpp"

namespace btfield::cli {

/// Two pictures and the curves of both.
struct PlottedPair {
    std::array<std::string, 2> names;
    StatisticCurves curves;
};

/// One SVG picture: a row of three charts (covariance by lag, spectrum, histogram) for every plane of every
/// pair.
[[nodiscard]] std::string curves_svg(std::span<const PlottedPair> pairs);
/// A page of its own that holds that picture and needs nothing else.
[[nodiscard]] std::string curves_page(std::span<const PlottedPair> pairs);

}  // namespace btfield::cli
