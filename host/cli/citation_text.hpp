#pragma once

#include <string_view>

namespace btfield::detail {

/// CITATION.cff, by that name.
[[nodiscard]] std::string_view citation_text(std::string_view name);

}  // namespace btfield::detail
