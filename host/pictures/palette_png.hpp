#pragma once

/// \file
/// PNG as it is stored, of labels: decode_png() turns indices into colours.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "btfield/image.hpp"

namespace btfield::detail {

/// Indices into a palette, or grey as it is stored.
struct PaletteImage {
    Size size;
    std::vector<std::uint8_t> values;  ///< [row][column]
    int colours = 0;  ///< of the file's palette, beyond which indices may point; 256 for grey
    std::array<std::uint8_t, 256> alpha{};  ///< of each value, 255: opaque
};

/// Empty when the file, known to be PNG, has neither a palette nor grey of up to 8 bits without alpha.
/// \throws InputError when it is damaged
[[nodiscard]] std::optional<PaletteImage> decode_palette_png(const std::filesystem::path& path,
                                                             const std::string& asked);

/// A PNG of 8 bits; the same pixels make the same bytes.
/// \param values   [row][column], each an index into the palette
/// \param palette  1 to 256 colours
/// \throws InputError when a side is too long for the decoder
[[nodiscard]] std::string encode_palette_png(Size size, std::span<const std::uint8_t> values,
                                             std::span<const std::array<std::uint8_t, 3>> palette,
                                             const std::string& asked);

}  // namespace btfield::detail
