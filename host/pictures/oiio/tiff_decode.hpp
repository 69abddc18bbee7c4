#pragma once

/// \file
/// TIFF through libtiff: OpenImageIO 2.4 turns only some kinds of colours round, takes the first picture of a
/// file, and scales numbers whose unit is theirs.

#include <filesystem>
#include <string>

#include "btfield/image_io.hpp"

namespace btfield::detail {

/// Reads what is wanted of a file that is known to be TIFF: unsigned integers of 1 to 32 bits, signed ones of
/// 8, 16 and 32, half and float; strips and tiles, planes beside each other or apart; grey either way round,
/// palette, RGB, YCbCr, CMYK, CIELab and LogLuv. Values are not looked at.
/// \param file_bytes  size of the file, against headers that claim more than it can hold
/// \throws InputError as read_picture()
[[nodiscard]] Picture decode_tiff(const std::filesystem::path& path, const ReadOptions& options,
                                  std::uintmax_t file_bytes, const std::string& asked);

}  // namespace btfield::detail
