#pragma once

/// \file
/// The attributes of an OpenEXR file, whose sizes its decoder believes: it takes the memory before it reads.

#include <cstdint>
#include <filesystem>
#include <string>

namespace btfield::detail {

/// Looks at sizes only: whatever else may be wrong is left to the decoder.
/// \throws InputError when an attribute of a header claims more bytes than the file has after it.
void check_exr_header(const std::filesystem::path& path, std::uintmax_t file_bytes, const std::string& asked);

}  // namespace btfield::detail
