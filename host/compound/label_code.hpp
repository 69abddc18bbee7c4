#pragma once

// Labels in few bytes, as model files hold them.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "btfield/control_field.hpp"

namespace btfield::detail {

/// The labels in raster order, each as a few decisions (is it the left neighbour's, the upper one's, how far
/// from the left one's) in an arithmetic code, whose probabilities are mixed from those of several
/// neighbourhoods; then a checksum of 32 bits. Integers alone: the same bytes on every machine.
/// \throws InputError when check() refuses the field
[[nodiscard]] std::vector<std::uint8_t> encode_labels(const ControlField& field);

/// \param asked  what the caller wanted, for messages
/// \throws InputError when the size or the number of regions is none, or the code is not one of such a field
[[nodiscard]] std::vector<std::uint8_t> decode_labels(std::span<const std::uint8_t> code, Size size,
                                                      int regions, const std::string& asked);

}  // namespace btfield::detail
