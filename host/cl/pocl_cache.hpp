#pragma once

/// \file
/// A place where PoCL, the driver for any CPU, may keep what it compiles. Without one it offers no device;
/// where its files are damaged, it ends the process.

#include <filesystem>
#include <string>

namespace btfield::detail {

/// Where PoCL keeps compiled kernels, by its own rule: POCL_CACHE_DIR, else pocl/kcache in XDG_CACHE_HOME or
/// in ~/.cache.
[[nodiscard]] std::filesystem::path pocl_cache_folder();

/// Before the first OpenCL call of the process: where that folder cannot be written or its disk is full, sets
/// POCL_CACHE_DIR to a private folder for temporary files, which goes with the process. Later calls do
/// nothing.
void give_pocl_a_cache();

/// What helps where PoCL's cache is damaged or full: "remove '...'".
[[nodiscard]] std::string pocl_cache_remedy();

}  // namespace btfield::detail
