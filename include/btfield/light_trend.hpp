#pragma once

/// \file
/// Light that falls unevenly on a sample: told, and taken out (theory 19.7).

#include <optional>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/height.hpp"
#include "btfield/image.hpp"

namespace btfield {

struct LightTrend {
    /// The simplest shape that shows: a slope, or a slope and a bowl.
    Flattening shape = Flattening::plane;
    double range = 0.0;  ///< largest less smallest brightness of the trend, over its mean
};

/// A trend of the brightness of colours, in linear light, over all of the picture, that stands out of what
/// the material itself varies by: means of 8 × 8 blocks follow it, by an F test and by their share of
/// variance. Nothing where none does, where it is below 5 % or, as parts of a material are, above 60 %, in
/// pictures without colours or with a side below 64.
[[nodiscard]] BTFIELD_API std::optional<LightTrend> light_trend(const Image& image);

struct FlattenedPicture {
    Image image;
    double range = 0.0;  ///< as in LightTrend, of the plane that has most; of data over their deviation
    /// Of each plane, the share of its variance that is left: 1 where nothing was taken out. 0 where next to
    /// nothing would be: such planes are constant.
    std::vector<double> left;
};

/// The picture without its trend: the plane, or (`low`) the polynomial of second degree, that fits a plane of
/// the picture best. Colours are divided by it, in linear light; planes of data in pictures without colours
/// have it subtracted, beside colours they stay. Means are kept.
/// \throws InputError where the trend of colours comes near 0, nothing is left of any plane that varies, or
///     the flattening is `none`
[[nodiscard]] BTFIELD_API FlattenedPicture flattened(const Image& image, Flattening flattening);

}  // namespace btfield
