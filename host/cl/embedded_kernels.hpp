#pragma once

#include <string_view>

namespace btfield::detail {

/// Source of kernels/NAME.cl with its includes in place; empty when there is none.
[[nodiscard]] std::string_view embedded_kernel(std::string_view name);

}  // namespace btfield::detail
