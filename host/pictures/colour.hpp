#pragma once

/// \file
/// Arithmetic of colours: primaries as matrices, and between the spaces of ColourSpace.

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "btfield/image_io.hpp"
#include "host/base/srgb_curve.hpp"

namespace btfield::detail {

/// Row-major.
using Matrix3 = std::array<double, 9>;

/// Primaries and white of Rec. 709 and sRGB: D65.
inline constexpr Chromaticities rec709{0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290};

[[nodiscard]] Matrix3 product(const Matrix3& a, const Matrix3& b);
/// Nothing when it is singular.
[[nodiscard]] std::optional<Matrix3> inverse(const Matrix3& matrix);

/// Linear values of these primaries as XYZ whose Y is 1 for white. Nothing when they span no colours.
[[nodiscard]] std::optional<Matrix3> xyz_from(const Chromaticities& primaries);

/// Linear values of these primaries as linear Rec. 709, white becoming white (Bradford's adaptation).
[[nodiscard]] std::optional<Matrix3> rec709_from(const Chromaticities& primaries);

/// XYZ under one white as it looks under another (Bradford), whites by their x and y.
[[nodiscard]] Matrix3 adaptation(std::array<double, 2> from, std::array<double, 2> to);

/// Whether both give the same colours, to what writers round.
[[nodiscard]] bool same_primaries(const Chromaticities& a, const Chromaticities& b, double tolerance = 2e-3);

/// Every pixel of three planes times the matrix.
void transform(Image& image, const Matrix3& matrix);

/// Linear light as sRGB-encoded values, and back; of any number of planes.
void encode_srgb(Image& image);
void decode_srgb(Image& image);

/// What is wrong with spaces of single planes; empty: nothing.
[[nodiscard]] std::string defect_of(std::span<const ColourSpace> spaces, int planes);

/// Spaces of these planes of a picture, xyz only where its three stay in a row.
[[nodiscard]] std::vector<ColourSpace> spaces_of(std::span<const ColourSpace> spaces,
                                                 std::span<const int> planes);

/// Colours among planes of several kinds as those of another space; the others stay.
void convert_planes(Image& image, ColourSpace to);

/// Values of the space as those of another, neither of them unspecified; XYZ has three planes.
void convert(Image& image, ColourSpace to);

}  // namespace btfield::detail
