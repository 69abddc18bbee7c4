#pragma once

/// \file
/// Names of several outputs.

#include <filesystem>

namespace btfield::cli {

/// "out.png" becomes "out-07.png" for picture 7 of 12: names sort as the numbers do.
[[nodiscard]] std::filesystem::path numbered(const std::filesystem::path& path, int index, int count);

}  // namespace btfield::cli
