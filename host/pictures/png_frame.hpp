#pragma once

/// \file
/// The chunks around a PNG's pixels. The decoder forgives a missing end, and fails over chunks that do not
/// matter; so every chunk is checked before the decoder sees it, and it sees only those that do.

#include <cstdint>
#include <filesystem>
#include <string>

#include "host/pictures/png_colours.hpp"

namespace btfield::detail {

/// Of both sides: the decoders' own limit.
constexpr std::uint32_t most_png_pixels = 1000000;

/// Bytes of a complete PNG with only the chunks that decide about pixel values.
/// \param chunks gets what others say, where it is not null
/// \throws InputError when the file ends early, a chunk's checksum is wrong, or the header is impossible or
///     claims more pixels than the file can hold.
[[nodiscard]] std::string checked_png(const std::filesystem::path& path, const std::string& asked,
                                      PngChunks* chunks = nullptr);

}  // namespace btfield::detail
