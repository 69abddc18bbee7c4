#include "host/base/huge_pages.hpp"

#include <sys/mman.h>

#include <cstdint>
#include <limits>
#include <new>

namespace btfield::detail {
namespace {

std::size_t whole_pages(std::size_t bytes) {
    return (bytes + huge_page - 1) / huge_page * huge_page;
}

}  // namespace

void* map_huge(std::size_t bytes) {
    if (bytes > std::numeric_limits<std::size_t>::max() - 2 * huge_page) throw std::bad_alloc();
    const std::size_t whole = whole_pages(bytes);
    // One page more than needed: what lies before and after the first multiple is given back.
    void* const mapped =
        ::mmap(nullptr, whole + huge_page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (mapped == MAP_FAILED) throw std::bad_alloc();
    const auto address = reinterpret_cast<std::uintptr_t>(mapped);
    const std::size_t before = (huge_page - address % huge_page) % huge_page;
    auto* const first = static_cast<std::byte*>(mapped);
    if (before > 0) ::munmap(first, before);
    ::munmap(first + before + whole, huge_page - before);
#ifdef MADV_HUGEPAGE
    static_cast<void>(::madvise(first + before, whole, MADV_HUGEPAGE));
#endif
    return first + before;
}

void unmap_huge(void* memory, std::size_t bytes) noexcept {
    if (memory != nullptr) ::munmap(memory, whole_pages(bytes));
}

}  // namespace btfield::detail
