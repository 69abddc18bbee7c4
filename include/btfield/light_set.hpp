#pragma once

/// \file
/// Pictures of one view under many lights, as their folders and tables describe them.

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "btfield/api.hpp"

namespace btfield {

/// One picture and its light.
struct LightPicture {
    std::filesystem::path picture;
    /// To the light, of length 1: x right, y up, z to the viewer, above 0.
    std::array<double, 3> direction{};
    /// What values are divided by: nothing, one number, or one for each plane.
    std::vector<double> intensity;
};

struct LightSet {
    std::vector<LightPicture> lights;
    std::filesystem::path mask;  ///< empty where the folder has none
    /// "lp", "diligent", "table" or "btf".
    std::string layout;
    /// What was left out, one sentence each, without capital and full stop.
    std::vector<std::string> remarks;
};

struct LightSetOptions {
    /// Lights whose z is not above 0 are left out; else they are errors.
    bool leave_out_behind = false;
};

/// Reads what says where lights are; no picture is opened yet, but every one is there. What is understood:
///   - a .lp file: a count, then a name and x, y, z to a line. Names may have blanks and back-slashes, and
///     are sought beside the file by their path and then by their last part. Vectors may have any length.
///   - a folder as DiLiGenT has it: light_directions.txt, filenames.txt, and where they are there
///     light_intensities.txt (a number for each plane) and mask.png. A .lp file in such a folder takes these.
///   - a folder with one .lp file, or with a table light_directions.txt, directions.txt or lights.txt (also
///     .csv): lines of a name and x, y, z, or of x, y, z alone for its pictures by name, numbers in them by
///     value
///   - a folder of a BTF, pictures tlTTT_plPPP_tvTTT_pvPPP in it or in folders of it: the view from above,
///     tv 0
/// \throws InputError when nothing of that is there, a line cannot be understood, a picture is missing or
///     there twice, there are fewer than three lights, they lie in one plane, or one is behind the surface
[[nodiscard]] BTFIELD_API LightSet read_light_set(const std::filesystem::path& lights,
                                                  const LightSetOptions& options = {});

}  // namespace btfield
