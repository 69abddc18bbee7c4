#pragma once

// Which texture a direction has, and what it takes of its own (theory 22.2).

#include <cstddef>
#include <cstdint>
#include <vector>

#include "btfield/btf_textures.hpp"
#include "host/btf/direction_table.hpp"

namespace btfield::detail {

class TexturesDirections {
  public:
    explicit TexturesDirections(const BtfTextures& model);

    /// The pair.
    [[nodiscard]] std::size_t nearest(const BtfDirection& view, const BtfDirection& light) const;
    /// Directions as low as the horizon, or lower, are those of the ring.
    [[nodiscard]] BtfTextureLook look(const BtfDirection& view, const BtfDirection& light) const;
    /// θ of the outermost ring of lights.
    [[nodiscard]] double steepest_light() const { return directions_.points().steepest_light(); }

  private:
    MeasuredDirections directions_;
    std::vector<std::uint16_t> labels_;
    std::vector<float> light_;  ///< [pair][means, deviations]; empty where nothing is matched
};

}  // namespace btfield::detail
