#pragma once

/// \file
/// Pictures with more memory than they show: what fills them may work there first.

#include <cstddef>
#include <span>

#include "btfield/image.hpp"

namespace btfield::detail {

struct PictureRoom {
    /// A picture to be filled: large ones begin with anything.
    /// \param room  values that the picture's memory holds in all; no fewer than the picture's own
    /// \throws InputError as Image does
    [[nodiscard]] static Image make(Size size, int planes, ColourSpace space, std::size_t room);
    /// The picture's values, then what is left of its memory.
    [[nodiscard]] static std::span<float> of(Image& image);
};

}  // namespace btfield::detail
