#pragma once

/// \file
/// Which channels of a file become planes, in which order, and what their names say.

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "btfield/image_io.hpp"

namespace btfield::detail {

struct ChannelPlan {
    std::vector<int> planes;  ///< channels, in the order of the planes
    std::vector<int> alpha;   ///< channels that are set aside
    /// Of the planes, well-formed UTF-8; empty where they say no more than the colour space does.
    std::vector<std::string> names;
    /// What the names say of the values; nothing where they say nothing.
    std::optional<ColourSpace> colours;
};

/// Alpha is every channel named A or alpha (AR, AG, AB beside R, G, B) of a layer that holds something else;
/// that of L, A, B is a colour. Three channels called red, green and blue, or R, G and B behind the same
/// letters, are in that order; wavelengths ("450nm", "S0.450,5nm", "w450") ascend.
/// \param names of all channels, as the file has them
/// \param chosen as ReadOptions::planes
/// \param alpha channel that the format declares as such; -1: none
/// \throws InputError when a chosen name or number does not exist
[[nodiscard]] ChannelPlan plan_channels(const std::vector<std::string>& names,
                                        const std::vector<std::string>& chosen, int alpha,
                                        const std::string& asked);

/// "Y", "Y" and "A", "R" to "B", "R" to "A": of formats whose channels have no names; more are numbered.
[[nodiscard]] std::vector<std::string> channel_names(int count);

/// Leaves the plan's planes, of a picture whose planes are all of a file's channels without alpha, in order.
void keep_planes(Picture& picture, const ChannelPlan& plan);

/// Wavelength that a channel's name tells, in nanometres; nothing where it tells none.
[[nodiscard]] std::optional<double> wavelength_of(std::string_view name);

/// What the names of planes of one kind share: colours of one layer, its X, Y and Z, wavelengths. Empty for
/// a name that says nothing of the kind.
[[nodiscard]] std::string kind_of_name(std::string_view name);

/// What each channel of a file of linear light holds, by its name: colours of each layer that has all three,
/// X, Y and Z without a layer, Y without X (grey). Unspecified: the rest.
[[nodiscard]] std::vector<ColourSpace> spaces_of_channels(const std::vector<std::string>& names);

/// Red, green and blue of each layer that has all three, without those whose names say that they are no
/// colours: normals, positions, roughness and the like.
[[nodiscard]] std::vector<std::array<int, 3>> colour_layers(const std::vector<std::string>& names);

}  // namespace btfield::detail
