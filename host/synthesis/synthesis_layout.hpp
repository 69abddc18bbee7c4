#pragma once

// Sizes of all lattices of one synthesis, and the device memory that its levels take (theory 14.5).

#include <string>
#include <vector>

#include "btfield/synthesis.hpp"
#include "host/synthesis/recursion_stability.hpp"

namespace btfield::detail {

/// How a level is grown.
enum class LevelRoute {
    spectrum,     ///< noise drawn in frequency, filtered, transformed
    transfer,     ///< noise drawn on the lattice, transformed, filtered, transformed back
    convolution,  ///< noise drawn on the lattice and convolved there
    recursion,    ///< noise drawn on the lattice and its border, run through in raster order
};

class SynthesisLayout {
  public:
    /// \param routes   one to each level of the model
    /// \param margins  of raster recursions one to each level, else none
    /// \throws InputError when a side is beyond what is computed
    SynthesisLayout(const TextureModel& model, Size size, std::vector<LevelRoute> routes,
                    std::vector<RecursionMargins> margins = {});

    Size size;                     ///< of the textures
    Size lattice;                  ///< of the finest level before cropping
    Offset crop;                   ///< where the texture begins in it
    std::vector<Size> sizes;       ///< per level
    std::vector<Size> transforms;  ///< per level; larger than the level where n has a prime factor over 13
    std::vector<LevelRoute> routes;
    std::vector<RecursionMargins> margins;

    /// The same work for textures of another size.
    [[nodiscard]] SynthesisLayout resized(const TextureModel& model, Size other) const;
    /// Opposite edges of the texture continue each other.
    [[nodiscard]] bool tiles() const;
    /// Bytes of device memory for `planes` modelled planes of all textures of a batch at once, without stored
    /// factors and what follows the levels.
    /// \param packed  spectra are transformed where they lie
    [[nodiscard]] double bytes(int planes, bool packed) const;
    /// The largest single buffer among them.
    [[nodiscard]] double largest(int planes, bool packed) const;

  private:
    /// Pixels of the lattice that a recursion runs over.
    [[nodiscard]] double domain(std::size_t level) const;
};

}  // namespace btfield::detail
