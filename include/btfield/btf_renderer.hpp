#pragma once

/// \file
/// A material that a BTF model tells, seen by a camera: on a plane or a sphere, under directional light
/// (theory 23.1).

#include <cstdint>
#include <memory>
#include <string_view>

#include "btfield/api.hpp"
#include "btfield/btf_model.hpp"
#include "btfield/btf_set.hpp"
#include "btfield/btf_textures.hpp"
#include "btfield/device.hpp"
#include "btfield/image.hpp"

namespace btfield {

enum class BtfShape {
    plane,   ///< endless, it fills the picture
    sphere,  ///< its diameter is 9/10 of the picture's shorter side
};

/// "plane", "sphere".
[[nodiscard]] BTFIELD_API std::string_view name(BtfShape shape);

/// What the camera sees. The camera is orthographic and looks at the middle of the shape.
struct BtfScene {
    BtfShape shape = BtfShape::sphere;
    Size size{512, 512};  ///< of the picture
    /// Pixels of the picture that a pixel of the material takes, where it faces the camera. On a sphere as
    /// near to it as whole tiles around the equator allow.
    double scale = 1.0;
    /// Beside the shape: share of white, linear.
    double background = 0.02;
};

/// Tiles of the material around the equator of a scene's sphere: at least 1.
[[nodiscard]] BTFIELD_API int tiles_around(const BtfScene& scene, int tile_width);

/// A grown tile of a material, shown on shapes. Any number of threads may ask one for pictures at a time.
class BTFIELD_API BtfRenderer {
  public:
    /// Grows the tile.
    /// \param device is to outlive it; the model need not
    /// \throws InputError as BtfSynthesiser does
    BtfRenderer(Device& device, const BtfModel& model, Size tile, std::uint64_t seed,
                bool allow_invalid = false);
    /// Of a surface that is there: height in pixels, then T.
    /// \throws InputError as BtfSynthesiser does
    BtfRenderer(Device& device, const BtfModel& model, const Image& surface);
    /// Of textures, which have no relief: each place has the nearest direction's, with the mean and contrast
    /// of its own view and light (theory 23.3). On a plane 1:1 from above it is
    /// BtfTextureSynthesiser::picture(). Textures are grown when a picture shows them first.
    /// \throws InputError as BtfTextureSynthesiser does
    BtfRenderer(Device& device, const BtfTextures& model, Size tile, std::uint64_t seed,
                bool allow_invalid = false);
    ~BtfRenderer();
    BtfRenderer(BtfRenderer&&) noexcept;
    BtfRenderer& operator=(BtfRenderer&&) noexcept;

    /// Linear light in shares of white (BtfModel::white): a white, matt, level surface that faces the light
    /// is 1. Planes and colour space are the model's. Directions are those of the shape's own frame, x right,
    /// y up and z to the viewer at view {0, 0}; from other views the camera has gone there the shortest way.
    /// On a plane it is BtfSynthesiser::picture() foreshortened, and dimmed where light is lower than any
    /// that was measured; 1:1 from above it is that picture, over and over.
    /// \throws InputError when a direction is not above the plane of the pictures, the size is less than a
    ///     pixel, scale is not above 0 or background below 0
    [[nodiscard]] Image picture(const BtfScene& scene, const BtfDirection& view,
                                const BtfDirection& light) const;
    /// Of the tile.
    [[nodiscard]] Size tile() const;
    [[nodiscard]] bool tileable() const;

  private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace btfield
