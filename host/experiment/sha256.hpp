#pragma once

/// \file
/// SHA-256 (FIPS 180-4): names for contents that are the same on every machine.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace btfield::detail {

class Sha256 {
  public:
    Sha256& add(std::string_view bytes);
    /// 64 hexadecimal digits. Call once.
    [[nodiscard]] std::string digest();

  private:
    void compress(const unsigned char* block);
    std::array<std::uint32_t, 8> state_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                        0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
    std::array<unsigned char, 64> pending_{};
    std::size_t held_ = 0;
    std::uint64_t bytes_ = 0;
};

[[nodiscard]] inline std::string sha256(std::string_view bytes) {
    return Sha256().add(bytes).digest();
}

/// Of the file's bytes.
/// \throws InputError when it cannot be read.
[[nodiscard]] std::string sha256_of_file(const std::filesystem::path& path);

}  // namespace btfield::detail
