#pragma once

// Files of host/rendering/page, embedded by CMake.

#include <string_view>

namespace btfield::detail {

/// The text of a file; empty where there is none of that name.
[[nodiscard]] std::string_view page_text(std::string_view name);

}  // namespace btfield::detail
