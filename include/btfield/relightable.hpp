#pragma once

/// \file
/// Pictures under many lights as one polynomial of the light at each pixel (theory 19.6): what viewers of
/// relightable pictures on the web show.

#include <array>
#include <string>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/device.hpp"
#include "btfield/image.hpp"
#include "btfield/light_set.hpp"
#include "btfield/relief.hpp"

namespace btfield {

struct LightPolynomial {
    /// Of 1, x, y, x², x y and y², x and y being those of the unit vector to the light: each for all planes
    /// of the pictures. Of values as a screen takes them, sRGB-encoded, 1 being white.
    Image coefficients;
    int planes = 0;      ///< of the pictures
    double white = 1.0;  ///< linear value, of a light of intensity 1, that is shown as white
    double error = 0.0;  ///< root mean square over all values of all pictures, in parts of white
    /// What may surprise, one sentence each, without capital and full stop.
    std::vector<std::string> remarks;
};

/// By least squares. Values brighter than white are white: of floats, and where lights have intensities,
/// white is what 999 of 1000 values do not exceed.
/// \param options  crop, coding, gamma and progress count
/// \throws InputError when there are fewer than six lights, or what fit_relief() refuses of pictures
[[nodiscard]] BTFIELD_API LightPolynomial fit_light_polynomial(Device& device, const LightSet& lights,
                                                               const ReliefOptions& options = {});

/// The picture that the polynomial has under a light, sRGB.
/// \param light  of any length, z above 0
/// \throws InputError when it is behind
[[nodiscard]] BTFIELD_API Image relight(const LightPolynomial& polynomial,
                                        const std::array<double, 3>& light);

/// Coefficients in pictures of whole numbers: (value − bias) scale.
struct RelightablePlanes {
    /// One for each coefficient, of three planes, from 0 to 1; grey thrice.
    std::vector<Image> pictures;
    std::vector<double> scale, bias;  ///< of each plane of each picture
};

/// One coefficient of a thousand, at either end, is cut off, so that the others have the steps.
/// \throws InputError unless the pictures have one or three planes
[[nodiscard]] BTFIELD_API RelightablePlanes relightable_planes(const LightPolynomial& polynomial);

}  // namespace btfield
