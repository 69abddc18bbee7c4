#pragma once

// Which texture a direction has, and what it takes of its own (theory 22.2).

#include <cstddef>
#include <memory>

#include "btfield/btf_textures.hpp"
#include "host/btf/direction_interpolation.hpp"

namespace btfield::detail {

class TexturesDirections {
  public:
    explicit TexturesDirections(const BtfTextures& model);
    TexturesDirections(const TexturesDirections&) = delete;
    TexturesDirections& operator=(const TexturesDirections&) = delete;

    /// The pair.
    [[nodiscard]] std::size_t nearest(const BtfDirection& view, const BtfDirection& light) const;
    [[nodiscard]] BtfTextureLook look(const BtfDirection& view, const BtfDirection& light) const;

  private:
    /// Means and deviations as means of twice as many colours: tables interpolate both alike.
    BtfModel table_;
    std::vector<std::uint16_t> labels_;
    bool matched_;
    std::unique_ptr<DirectionTable> directions_;
};

}  // namespace btfield::detail
