#pragma once

// The .btf files of the UBO2014 sets: FMF06, FMF12, DFMF, PVF, BDI.

#include <filesystem>
#include <memory>
#include <string_view>

#include "btfield/btf_set.hpp"

namespace btfield::detail {

/// Whether a file that begins so is one of them.
[[nodiscard]] bool is_ubo2014(std::string_view head);

/// \throws InputError when it is of an unknown kind, ends too early, or contradicts itself
[[nodiscard]] std::shared_ptr<const BtfSource> open_ubo2014(const std::filesystem::path& file);

}  // namespace btfield::detail
