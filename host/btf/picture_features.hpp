#pragma once

// What pictures of a set are compared by when they are clustered, and their moments (theory 22.1).

#include <span>
#include <vector>

#include "btfield/image.hpp"

namespace btfield::detail {

struct PictureMoments {
    std::vector<double> mean, deviation;  ///< of each colour, negative values counting as 0
};

[[nodiscard]] PictureMoments moments_of(const Image& picture);

inline constexpr int feature_bins = 64;

/// Features of a picture of so many planes: 3 histograms of colours; else one of each plane.
[[nodiscard]] int feature_count(const Image& picture);

/// Cumulative histograms, [histogram][bin], of 64 bins over L* from 0 to 100 and a* and b* from −112 to 112;
/// of a plane that is no colour, over the lightness that such a grey has.
/// \param white  value of a white surface
/// \param features  feature_count() of them
void put_features(const Image& picture, double white, std::span<float> features);

}  // namespace btfield::detail
