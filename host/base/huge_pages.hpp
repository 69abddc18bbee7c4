#pragma once

/// \file
/// Large memory in huge pages: touching fresh memory page by page takes as long as computing what goes there.

#include <cstddef>

namespace btfield::detail {

inline constexpr std::size_t huge_page = std::size_t{2} << 20;

/// Zero-filled memory of whole huge pages, at a multiple of their size. Where the system refuses huge pages
/// it is as good as any other.
/// \throws std::bad_alloc
[[nodiscard]] void* map_huge(std::size_t bytes);
/// \param bytes  as map_huge() was asked for; null memory is none
void unmap_huge(void* memory, std::size_t bytes) noexcept;

}  // namespace btfield::detail
