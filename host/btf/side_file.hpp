#pragma once

// btf.json, what names of pictures in a folder cannot tell.

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "btfield/btf_set.hpp"

namespace btfield::detail {

inline constexpr const char* side_file_name = "btf.json";
inline constexpr const char* height_file_name = "height.exr";

struct SideFile {
    double exposure = 1.0;
    std::optional<double> white;
    std::string height;  ///< a file beside it; empty: none
};

/// \throws InputError when it is damaged
[[nodiscard]] SideFile parse_side_file(std::string_view text, const std::string& asked);

[[nodiscard]] std::string side_file_text(const BtfDescription& set, double exposure);

/// And height.exr beside it, where the set has a range map.
void write_side_file(const std::filesystem::path& folder, const BtfDescription& set, double exposure);

}  // namespace btfield::detail
