#pragma once

// What the environment lets btfield use.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace btfield::detail {

/// Bytes of "1500000", "500M", "2.5G", "2.5GB": K, M, G and T are powers of 1000. Nothing for other text,
/// less than a byte, or more than 2^63.
[[nodiscard]] std::optional<std::uint64_t> parse_bytes(std::string_view text);

/// "1 byte", "640 bytes", "12.3 kB", "4.0 MB", "10.3 GB".
[[nodiscard]] std::string bytes_text(double bytes);

/// $BTFIELD_THREADS; 0 without.
/// \throws InputError when it is no whole number from 1 on
[[nodiscard]] int threads_of_environment();

/// Bytes that $BTFIELD_MEMORY says; 0 without.
/// \throws InputError when parse_bytes() knows nothing of it
[[nodiscard]] std::uint64_t memory_of_environment();

/// "the process may have 200.0 MB of addresses (ulimit -v)"; empty where that has no limit.
[[nodiscard]] std::string address_space_text();
inline constexpr const char* more_address_space = "raise the limit: ulimit -v unlimited";

}  // namespace btfield::detail
