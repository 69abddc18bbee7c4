#pragma once

/// \file
/// The statistics of two pictures as curves: what compare() boils down to single numbers, to be looked at.

#include <array>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/image.hpp"
#include "btfield/neighbourhood.hpp"

namespace btfield {

/// Of A and B, each value [A, B], in units of A: covariances and spectra over A's variance, so that A's curve
/// begins with 1. NaN for a plane of A that is constant.
struct StatisticCurves {
    struct Plane {
        /// C_ii(s) at `lags`, on the torus, means removed.
        std::vector<std::array<double, 2>> covariance;
        /// Mean of |Ỹ_i|² / (H W) over the frequencies of a ring, at `frequencies`. White noise has 1
        /// everywhere.
        std::vector<std::array<double, 2>> spectrum;
        /// Ends of the bins of the histogram, equally wide from the least value of both to the largest.
        std::vector<double> edges;
        /// Share of the pixels in each bin.
        std::vector<std::array<double, 2>> histogram;
    };
    /// (0, 0), then (0, h), (h, 0), (h, h), (h, −h) for h = 1, 2, 3, 4, 6, 8, 12, … as far as h is less than
    /// half of all sides, at most 64.
    std::vector<Offset> lags;
    /// Cycles per pixel, ascending, centres of rings that are three to the octave where a picture has so many
    /// frequencies; at most 1 / √2.
    std::vector<double> frequencies;
    std::vector<Plane> planes;
};

/// Sizes may differ, numbers of planes may not.
/// \throws InputError when a picture is empty, holds NaN or infinity, or the numbers of planes differ
[[nodiscard]] BTFIELD_API StatisticCurves statistic_curves(const Image& a, const Image& b);

}  // namespace btfield
