#pragma once

// The readers of bytes that nobody has vouched for, each by itself, for the fuzzer.

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace btfield::test {

struct FuzzTarget {
    std::string_view name;
    /// Reads the bytes, and checks what it got. InputError is an answer; whatever else it throws is a
    /// finding.
    void (*read)(std::string_view bytes);
    /// Bytes to begin with: good ones of every kind.
    std::vector<std::string> (*seeds)();
    /// Changed bytes made such that a checksum does not hide them from the reader; null where there is none.
    void (*repair)(std::uint8_t* bytes, std::size_t size) = nullptr;
};

[[nodiscard]] std::vector<FuzzTarget> model_targets();
[[nodiscard]] std::vector<FuzzTarget> picture_targets();
[[nodiscard]] std::vector<FuzzTarget> btf_targets();

/// A finding where the condition does not hold.
void demand(bool condition, const char* what);

/// A finding where the text is not one line of UTF-8 without control characters, as people are told.
void check_message(std::string_view message);

/// A file in memory, one per process, for readers that take nothing but names.
[[nodiscard]] const std::filesystem::path& file_with(std::string_view bytes);

}  // namespace btfield::test
