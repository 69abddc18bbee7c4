#pragma once

// A checksum of any number of bytes against damage by chance, not by intent.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace btfield::detail {

/// XXH64 of what has been added, with seed 0 (Y. Collet, xxHash specification): 32 bytes at a time, faster
/// than a disk reads them.
class Checksum {
  public:
    void add(std::span<const std::byte> bytes);
    [[nodiscard]] std::uint64_t value() const;

  private:
    std::array<std::uint64_t, 4> lanes_{0x60ea27eeadc0b5d6U, 0xc2b2ae3d27d4eb4fU, 0U, 0x61c8864e7a143579U};
    std::array<std::byte, 32> waiting_{};  ///< the last size_ % 32 bytes
    std::uint64_t size_ = 0;
};

[[nodiscard]] std::uint64_t checksum(std::span<const std::byte> bytes);

}  // namespace btfield::detail
