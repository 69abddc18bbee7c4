#pragma once

/// \file
/// What models of BTFs keep of the sets that they were fitted to.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/btf_set.hpp"
#include "btfield/image.hpp"

namespace btfield {

/// How a BTF becomes a model.
enum class BtfMethod {
    joint,    ///< planes of the surface that all pictures share (btf_model.hpp; theory 21)
    segment,  ///< a texture for each cluster of pictures (btf_textures.hpp; theory 22; P3)
    each,     ///< a texture for each picture (btf_textures.hpp; theory 22; P4)
};
/// "joint", "segment", "each".
[[nodiscard]] BTFIELD_API std::string_view name(BtfMethod method);
/// Inverse of name().
/// \throws InputError for any other text, listing those that exist
[[nodiscard]] BTFIELD_API BtfMethod btf_method(std::string_view name);

/// Pictures that a fit is not shown, but scored by. 0: none.
struct BtfLeaveOut {
    int pairs = 0;   ///< one in n: those whose indices of view and light add up to a multiple of n, less 1
    int views = 0;   ///< of every n-th view all
    int lights = 0;  ///< of every n-th light all
    [[nodiscard]] bool any() const { return pairs > 0 || views > 0 || lights > 0; }
};

struct BtfMeasured {
    Size size;        ///< of the pictures
    int colours = 0;  ///< planes of a picture
    ColourSpace space = ColourSpace::linear;
    std::vector<std::string> names;  ///< of the colours: empty, or one for each
    double white = 1.0;              ///< value of a white diffuse surface
    std::vector<BtfDirection> views, lights;
    std::vector<BtfPair> pairs;  ///< of views and lights, those that the model has tables of
    /// Where light came from in each pair; empty: from the direction of its index.
    std::vector<BtfDirection> true_lights;
    std::uint64_t pictures = 0, picture_bytes = 0;  ///< of the set: number, and bytes at 8 bits a value
    std::uint64_t file_bytes = 0;                   ///< of its files; 0: there were none
};

}  // namespace btfield
