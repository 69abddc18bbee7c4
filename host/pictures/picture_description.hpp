#pragma once

// What files say of a picture in words.

#include <string>
#include <vector>

#include "btfield/image.hpp"
#include "host/pictures/picture_format.hpp"

namespace btfield::detail {

/// What the file's kind does not say by itself: the colour space where a reader would assume another, and
/// names where channels have none.
/// \param channels  of the file
[[nodiscard]] std::string description_of(const Image& image, const Storage& storage,
                                         const std::vector<std::string>& channels);

}  // namespace btfield::detail
