#pragma once

/// \file
/// Large memory in huge pages: touching fresh memory page by page takes as long as computing what goes there.

#include <algorithm>
#include <cstddef>

namespace btfield::detail {

inline constexpr std::size_t huge_page = std::size_t{2} << 20;

/// Zero-filled memory of whole huge pages, at a multiple of their size. Where the system refuses huge pages
/// it is as good as any other.
/// \throws std::bad_alloc
[[nodiscard]] void* map_huge(std::size_t bytes);
/// \param bytes  as map_huge() was asked for; null memory is none
void unmap_huge(void* memory, std::size_t bytes) noexcept;

/// Such memory, handed out from its beginning on.
class HugeMemory {
  public:
    /// \throws std::bad_alloc
    explicit HugeMemory(std::size_t bytes)
        : bytes_(bytes), memory_(static_cast<std::byte*>(map_huge(bytes))) {}
    ~HugeMemory() { unmap_huge(memory_, bytes_); }
    HugeMemory(const HugeMemory&) = delete;
    HugeMemory& operator=(const HugeMemory&) = delete;
    /// So many bytes, from a small page's beginning on; null where they are not left.
    [[nodiscard]] std::byte* take(std::size_t bytes) {
        if (bytes > left()) return nullptr;
        std::byte* const begin = memory_ + taken_;
        taken_ += std::min(left(), (bytes + small_page - 1) / small_page * small_page);
        return begin;
    }
    [[nodiscard]] std::size_t left() const { return bytes_ - taken_; }

  private:
    static constexpr std::size_t small_page = 4096;
    std::size_t bytes_, taken_ = 0;
    std::byte* memory_;
};

}  // namespace btfield::detail
