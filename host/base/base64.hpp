#pragma once

// Bytes as text (RFC 4648, padded).

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace btfield::detail {

[[nodiscard]] std::string base64(std::span<const std::uint8_t> bytes);
/// As base64() writes it; nothing of any other text.
[[nodiscard]] std::vector<std::uint8_t> from_base64(std::string_view text);

}  // namespace btfield::detail
