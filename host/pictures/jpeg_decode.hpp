#pragma once

/// \file
/// JPEG through libjpeg: OpenImageIO 2.4 turns four inks into RGB without their profile, and reads beyond the
/// ends of damaged profiles and EXIF, whose meaning it does not take anyway.

#include <cstdint>
#include <filesystem>
#include <string>

#include "btfield/image_io.hpp"

namespace btfield::detail {

/// Grey, colours and four inks of 8 bits, of several pictures in a row the first; the ICC profile, EXIF's
/// orientation and Adobe RGB are applied.
/// \param file_bytes  size of the file, against headers that claim more than it can hold
/// \throws InputError as read_picture(); for damage of any kind, which libjpeg would paint over
[[nodiscard]] Picture decode_jpeg(const std::filesystem::path& path, const ReadOptions& options,
                                  std::uintmax_t file_bytes, const std::string& asked);

}  // namespace btfield::detail
