#pragma once

// Textures that stand for pictures, on a plane or a sphere (theory 23.3).

#include <cstdint>
#include <vector>

#include "btfield/btf_renderer.hpp"
#include "btfield/btf_textures.hpp"
#include "host/btf/textures_directions.hpp"
#include "host/rendering/sphere_frame.hpp"

namespace btfield::detail {

/// For any number of threads.
class TexturedShape {
  public:
    /// \throws InputError as BtfTextureSynthesiser
    TexturedShape(Device& device, const BtfTextures& model, Size tile, std::uint64_t seed,
                  bool allow_invalid);
    [[nodiscard]] Image plane(const BtfScene& scene, const BtfDirection& view,
                              const BtfDirection& light) const;
    /// \param light  unit vector in the sphere's frame
    /// \param background  of each colour
    [[nodiscard]] Image sphere(const BtfScene& scene, const CameraFrame& camera, const Vector3& light,
                               const std::vector<double>& background) const;
    [[nodiscard]] Size tile() const { return grown_.size(); }
    [[nodiscard]] bool tileable() const { return grown_.tileable(); }

  private:
    BtfTextureSynthesiser grown_;
    TexturesDirections directions_;
};

}  // namespace btfield::detail
