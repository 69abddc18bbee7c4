#pragma once

// Binary files of pictures that nobody has vouched for, little-endian as the machine.

#include <bit>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "host/base/file_output.hpp"

namespace btfield::detail {

static_assert(std::endian::native == std::endian::little);

/// An open file that any number of threads read at any place.
class ByteFile {
  public:
    /// \throws InputError when it cannot be opened or is no regular file
    ByteFile(const std::filesystem::path& path, std::string asked);
    [[nodiscard]] const std::string& asked() const { return asked_; }
    [[nodiscard]] std::uint64_t size() const { return size_; }
    /// file_stamp() when it was opened.
    [[nodiscard]] const std::string& stamp() const { return stamp_; }
    /// \throws InputError when the file ends before, or cannot be read
    void read(std::uint64_t at, void* to, std::uint64_t bytes) const;
    /// \throws InputError  whose remedy is to give a complete and undamaged file
    [[noreturn]] void refuse(const std::string& found) const;

  private:
    std::string asked_, stamp_;
    Descriptor file_;
    std::uint64_t size_ = 0;
};

/// Reads one value after the other.
class ByteCursor {
  public:
    explicit ByteCursor(const ByteFile& file, std::uint64_t at = 0)
        : file_(&file), at_(at), end_(file.size()) {}
    [[nodiscard]] std::uint64_t at() const { return at_; }
    [[nodiscard]] std::uint64_t left() const { return end_ - at_; }
    /// \param what  of the message, where the file ends before
    void skip(std::uint64_t bytes, const char* what);
    /// As skip(), of `count` things of this size, whose product may overflow.
    void skip(std::uint64_t count, std::uint64_t each, const char* what);
    template <typename Value>
    [[nodiscard]] Value take(const char* what) {
        static_assert(std::is_arithmetic_v<Value>);
        Value value;
        const std::uint64_t from = at_;
        skip(sizeof value, what);
        file_->read(from, &value, sizeof value);
        return value;
    }
    /// So many values; checked against the size of the file before memory is taken.
    template <typename Value>
    [[nodiscard]] std::vector<Value> take(std::uint64_t count, const char* what) {
        const std::uint64_t from = at_;
        skip(count, sizeof(Value), what);
        std::vector<Value> values(static_cast<std::size_t>(count));
        file_->read(from, values.data(), count * sizeof(Value));
        return values;
    }
    [[nodiscard]] std::string text(std::uint64_t bytes, const char* what);

  private:
    const ByteFile* file_;
    std::uint64_t at_, end_;
};

/// What values of a file are stored as.
enum class Scalar : std::uint8_t { byte = 1, half = 2, float32 = 4, float64 = 8 };
/// \throws InputError for other sizes
[[nodiscard]] Scalar scalar_of_bytes(std::uint64_t bytes, const ByteFile& file);
/// Reads values as float32; bytes become [0, 1]. What is not finite is refused.
void read_scalars(const ByteFile& file, std::uint64_t at, Scalar scalar, float* to, std::uint64_t count);

/// Bytes to a file under construction.
class ByteWriter {
  public:
    ByteWriter(int descriptor, std::string asked) : descriptor_(descriptor), asked_(std::move(asked)) {}
    /// \throws InputError when they cannot be written
    void bytes(const void* from, std::size_t count);
    template <typename Value>
    void value(Value v) {
        static_assert(std::is_arithmetic_v<Value>);
        bytes(&v, sizeof v);
    }
    void text(std::string_view t) { bytes(t.data(), t.size()); }

  private:
    int descriptor_;
    std::string asked_;
};

}  // namespace btfield::detail
