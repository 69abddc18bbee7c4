#pragma once

/// \file
/// Several maps of one material as one picture, and back (theory 20): what is modelled together is grown
/// together, and stays registered.

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/device.hpp"
#include "btfield/height.hpp"
#include "btfield/image.hpp"
#include "btfield/image_io.hpp"
#include "btfield/models.hpp"

namespace btfield {

/// By the words of a file's name, the last that says something: albedo, base colour, diffuse: colour; normal,
/// nor, nrm, nm, with gl or dx: normal; height, displacement, disp, bump: height; rough; metal; ao,
/// occlusion; opacity. `other` where none does.
[[nodiscard]] BTFIELD_API MapRole role_of_name(const std::filesystem::path& file);
/// The same of all maps of a material: where none is the colour by its name, the only one whose name says
/// nothing is, as `rock.png` beside `rock_normal.png`.
[[nodiscard]] BTFIELD_API std::vector<MapRole> roles_of_names(std::span<const std::filesystem::path> files);
/// Whether the name says that a normal map is DirectX's.
[[nodiscard]] BTFIELD_API bool says_directx(const std::filesystem::path& file);

/// A map as it was read.
struct MapPicture {
    std::string name;  ///< file name, without folders
    MapRole role = MapRole::other;
    Picture picture;
    bool directx = false;
};

/// Maps side by side.
struct Material {
    /// Planes of all maps, in their order, named NAME or NAME.CHANNEL after their files. Unspecified, so that
    /// colours, heights and the rest are each taken in their own unit. Heights that normals tell are in
    /// pixels, their mean 0; of normals without a height map there is (−Δ)^{1/2} of it, NAME.steepness.
    Image image;
    std::vector<MaterialMap> maps;
    /// What may surprise, one sentence each, without capital and full stop.
    std::vector<std::string> remarks;
};

/// Normals are not modelled, but the height that tells them. With a height map, its scale is the factor for
/// which its slopes come closest to those of the normals; then the normals decide about waves of up to 64
/// pixels, the height map about longer ones. Without one, the normals are integrated.
/// \throws InputError when there is no map, sizes differ, names do, two maps are normals or heights, a height
///     has not one plane or normals not three, or normals and height have nothing to do with each other
[[nodiscard]] BTFIELD_API Material join_maps(Device& device, std::span<const MapPicture> maps,
                                             SurfaceEdges edges = SurfaceEdges::mirror);

/// Sets the gains of heights in pixels such that a texture's height is as rough as the material's, octave by
/// octave. Random fields keep covariances to about a hundredth of the variance, which of a height is in its
/// long waves: slopes are in the short ones, and would come out too steep.
/// \param material  as join_maps() made it
/// \param texture   of the model without gains, not much smaller than the material
/// \throws InputError when planes do not agree
BTFIELD_API void match_relief(Device& device, std::vector<MaterialMap>& maps, const Image& material,
                              const Image& texture);

/// The maps of a texture: colours and the rest as their files hold them, heights in pixels with their gains,
/// normals as unit vectors of that height.
/// \param maps   of a model's provenance
/// \param image  as many planes as the maps have, a torus where edges are periodic
/// \throws InputError when planes do not agree
[[nodiscard]] BTFIELD_API std::vector<Image> split_maps(Device& device, std::span<const MaterialMap> maps,
                                                        const Image& image, SurfaceEdges edges);

}  // namespace btfield
