#include "host/pictures/picture_memory.hpp"

#include <sys/mman.h>

#include <array>
#include <mutex>

#include "host/base/huge_pages.hpp"

namespace btfield::detail {
namespace {

/// Pieces that were left, the last one at the end.
class IdleMemory {
  public:
    /// Never taken down: pictures may go after everything else.
    static IdleMemory& of_process() {
        static IdleMemory& memory = *new IdleMemory;
        return memory;
    }

    /// Null where there is none of this size.
    [[nodiscard]] void* take(std::size_t pages) {
        const std::lock_guard lock(mutex_);
        for (std::size_t i = count_; i-- > 0;)
            if (pieces_[i].pages == pages) return remove(i).memory;
        return nullptr;
    }

    /// Gives back what was left first where it becomes too much.
    void leave(void* memory, std::size_t pages) noexcept {
#ifdef MADV_FREE
        const bool kept = pages <= most_pages / 2 && ::madvise(memory, pages * huge_page, MADV_FREE) == 0;
#else
        const bool kept = false;
#endif
        if (!kept) return unmap_huge(memory, pages * huge_page);
        const std::lock_guard lock(mutex_);
        while (pages_ + pages > most_pages) {
            const Piece oldest = remove(0);
            unmap_huge(oldest.memory, oldest.pages * huge_page);
        }
        pieces_[count_++] = {memory, pages};
        pages_ += pages;
    }

  private:
    static constexpr std::size_t most_pages = idle_picture_bytes / huge_page;
    struct Piece {
        void* memory;
        std::size_t pages;
    };

    Piece remove(std::size_t place) noexcept {
        const Piece piece = pieces_[place];
        for (std::size_t i = place + 1; i < count_; ++i) pieces_[i - 1] = pieces_[i];
        --count_;
        pages_ -= piece.pages;
        return piece;
    }

    std::mutex mutex_;  ///< of what follows
    std::array<Piece, most_pages> pieces_{};
    std::size_t count_ = 0, pages_ = 0;
};

std::size_t pages_of(std::size_t bytes) {
    return (bytes + huge_page - 1) / huge_page;
}

}  // namespace

void* take_picture_memory(std::size_t bytes, bool filled) {
    if (!filled)
        if (void* const idle = IdleMemory::of_process().take(pages_of(bytes))) return idle;
    return map_huge(bytes);
}

void leave_picture_memory(void* memory, std::size_t bytes) noexcept {
    if (memory != nullptr) IdleMemory::of_process().leave(memory, pages_of(bytes));
}

}  // namespace btfield::detail
