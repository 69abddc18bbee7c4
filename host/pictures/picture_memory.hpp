#pragma once

/// \file
/// Large memory of pictures that come and go: fresh pages cost as much as a texture that fills them.

#include <cstddef>

namespace btfield::detail {

/// Bytes of all memory that waits for its next picture at most; glibc, too, keeps about that much. The system
/// takes it where it is short of memory.
inline constexpr std::size_t idle_picture_bytes = std::size_t{64} << 20;

/// At least so many bytes, no fewer than a huge page, as map_huge() gives them; filled with anything where
/// `filled` does not ask for zeros.
/// \throws std::bad_alloc
[[nodiscard]] void* take_picture_memory(std::size_t bytes, bool filled);
/// \param bytes  as they were asked for
void leave_picture_memory(void* memory, std::size_t bytes) noexcept;

}  // namespace btfield::detail
