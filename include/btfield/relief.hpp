#pragma once

/// \file
/// Normals and albedo of a surface from pictures of it under many lights (theory 19.3).

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/device.hpp"
#include "btfield/image.hpp"
#include "btfield/image_io.hpp"
#include "btfield/light_set.hpp"

namespace btfield {

/// How values under many lights make a normal.
enum class LightRule {
    automatic,  ///< huber, amb or lobe, whichever tells lights best that it was not shown, or ls (theory 19.4)
    ls,         ///< least squares over all lights
    ranks,      ///< over those of middling brightness at the pixel
    huber,      ///< over those that agree, shadows left out
    amb,        ///< and light from all around, as surfaces throw it at each other
    lobe,       ///< and a gloss
};

/// What numbers of a picture mean.
enum class LightCoding {
    automatic,  ///< linear or sRGB, whichever a matt surface could have
    linear,
    srgb,
    gamma,  ///< a power of ReliefOptions::gamma
};

struct ReliefOptions {
    LightRule rule = LightRule::automatic;
    /// Of rule ranks: values count from `low` to `high`, as parts of the way from the darkest to the
    /// brightest.
    double low = 0.35, high = 0.85;
    /// Of rule lobe: how broad its gloss is, from 0 to 1; without one, that of 0.3, 0.5 and 0.8 which tells
    /// other lights best.
    std::optional<double> roughness;
    LightCoding coding = LightCoding::automatic;
    double gamma = 2.2;
    std::optional<Crop> crop;
    /// Picture that is above half of white where the surface is; empty: that of the light set, or all of it.
    std::filesystem::path mask;
    bool ignore_mask = false;
    /// Called now and then with the stage and the share that is done; what it throws ends the work.
    std::function<void(std::string_view stage, double share)> progress;
};

struct Relief {
    Image normals;                     ///< unit vectors; (0, 0, 1) where there is no surface or all is dark
    Image albedo;                      ///< of each plane, in the unit of a light of intensity 1; linear
    Image residual;                    ///< Σ |I − model| / Σ I over all lights that are not saturated
    Image left_out;                    ///< the same of every fourth light by a fit to the others
    std::vector<std::uint8_t> inside;  ///< 1 where the surface is; empty: everywhere
    LightRule rule = LightRule::ls;    ///< never automatic
    double roughness = 0.0;            ///< of rule lobe; else 0
    LightCoding coding = LightCoding::linear;
    int lights = 0;
    double median_residual = 0.0;  ///< over the surface
    /// Median of |I − model| over what is bright at the pixel, at some pixels and under every fourth light,
    /// by a fit to the others; that of least squares. NaN with fewer than six lights.
    double left_out_error = 0.0, left_out_least_squares = 0.0;
    double shadowed = 0.0;              ///< share of values too dark to be lit
    double saturated = 0.0;             ///< share of values at the end of their range
    PixelType type = PixelType::uint8;  ///< of the pictures
    /// What may surprise, one sentence each, without capital and full stop.
    std::vector<std::string> remarks;
};

/// From files. Pictures are read once where all of them fit into a part of the memory that may be planned
/// with, else in strips; all that is asked for is checked before.
/// \param maps  whether Relief::left_out is wanted: a second fit of everything
/// \throws InputError when sizes or planes differ, or what read_picture() refuses
[[nodiscard]] BTFIELD_API Relief fit_relief(Device& device, const LightSet& lights,
                                            const ReliefOptions& options = {}, bool maps = false);

/// Of pictures in memory, in linear light whatever they say.
/// \param directions  to the light of each picture, of any length, z above 0
/// \throws InputError when there are fewer than three, or they lie in one plane
[[nodiscard]] BTFIELD_API Relief fit_relief(Device& device, std::span<const Image> pictures,
                                            std::span<const std::array<double, 3>> directions,
                                            const ReliefOptions& options = {});

}  // namespace btfield
