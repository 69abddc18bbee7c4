#pragma once

/// \file
/// What is left to do with a decoded picture of a format whose channels have no names.

#include <string>

#include "btfield/image_io.hpp"
#include "host/pictures/colour_profile.hpp"
#include "host/pictures/exif.hpp"

namespace btfield::detail {

/// What a file says beside its pixels.
struct Surroundings {
    ColourMeaning meaning;
    Exif exif;
    std::string description;  ///< where btfield may have written of colour spaces
    std::string remark;
};

/// Applies the meaning, turns the picture upright and leaves the planes that are wanted, which are chosen
/// once the colours are understood.
/// \param picture  all channels of the crop as they are stored, alpha, the last, set aside
/// \param channels of the file
/// \param alpha    the channel that is it; -1: none
/// \throws InputError as plan_channels()
void understand_unnamed(Picture& picture, int channels, int alpha, const Surroundings& around,
                        const ReadOptions& options, const std::string& asked);

}  // namespace btfield::detail
