#pragma once

#include <vector>

#include "btfield/image.hpp"

namespace btfield::peer {

/// 8 bits, three planes, into memory.
std::vector<unsigned char> png_bytes(const Image& image);

}  // namespace btfield::peer
