#pragma once

// One picture of a set as a texture (theory 22.2).

#include <string>

#include "btfield/btf_set.hpp"
#include "btfield/device.hpp"
#include "btfield/fit.hpp"
#include "btfield/models.hpp"
#include "host/btf/picture_features.hpp"

namespace btfield::detail {

struct PictureTexture {
    TextureModel texture;  ///< of z = √(I / μ), numbers in single precision
    PictureMoments moments;
};

/// The field, or one of lower order where the certificates of that fail; a constant picture is a texture
/// without contrast.
/// \throws InputError naming the picture
[[nodiscard]] PictureTexture picture_texture(Device& device, const BtfSet& set, const BtfPair& pair,
                                             const FitOptions& field);

/// I of a grown z.
/// \param means  μ
void light_of_relative(Image& z, std::span<const float> means);

/// "the picture of view (theta 15, phi 0) and light (theta 0, phi 0)"
[[nodiscard]] std::string text_of_pair(const BtfSet& set, const BtfPair& pair);

}  // namespace btfield::detail
