#pragma once

// What tells whether a file is still the one that was read.

#include <sys/stat.h>

#include <filesystem>
#include <string>

namespace btfield::detail {

/// Size and times of a file. Empty where it is so new that it could change again and look the same.
[[nodiscard]] std::string file_stamp(const struct ::stat& status);
/// Empty, too, where there is no such file.
[[nodiscard]] std::string file_stamp(const std::filesystem::path& file);

}  // namespace btfield::detail
