#include "tests/fuzz/zip_bytes.hpp"

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <stdexcept>

namespace btfield::test {
namespace {

constexpr std::uint32_t local_mark = 0x04034b50, central_mark = 0x02014b50, end_mark = 0x06054b50;
constexpr std::size_t local_bytes = 30, central_bytes = 46, end_bytes = 22;
/// Unpacked content that is looked at.
constexpr std::size_t most_unpacked = std::size_t{1} << 20;

std::uint32_t checksum_of(const std::string& content) {
    return static_cast<std::uint32_t>(
        ::crc32(0, reinterpret_cast<const Bytef*>(content.data()), static_cast<uInt>(content.size())));
}

std::string packed(const std::string& content) {
    z_stream stream{};
    if (::deflateInit2(&stream, 9, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY) != Z_OK)
        throw std::runtime_error("zlib does not begin");
    std::string bytes(::deflateBound(&stream, static_cast<uLong>(content.size())), '\0');
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(content.data()));
    stream.avail_in = static_cast<uInt>(content.size());
    stream.next_out = reinterpret_cast<Bytef*>(bytes.data());
    stream.avail_out = static_cast<uInt>(bytes.size());
    const int end = ::deflate(&stream, Z_FINISH);
    bytes.resize(stream.total_out);
    ::deflateEnd(&stream);
    if (end != Z_STREAM_END) throw std::runtime_error("zlib does not end");
    return bytes;
}

std::optional<std::string> unpacked(const std::uint8_t* from, std::size_t size) {
    z_stream stream{};
    if (::inflateInit2(&stream, -MAX_WBITS) != Z_OK) return std::nullopt;
    std::string content(most_unpacked, '\0');
    stream.next_in = const_cast<Bytef*>(from);
    stream.avail_in = static_cast<uInt>(size);
    stream.next_out = reinterpret_cast<Bytef*>(content.data());
    stream.avail_out = static_cast<uInt>(content.size());
    const int end = ::inflate(&stream, Z_FINISH);
    content.resize(stream.total_out);
    ::inflateEnd(&stream);
    if (end != Z_STREAM_END) return std::nullopt;
    return content;
}

template <typename Value>
void put(std::string& bytes, Value value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <typename Value>
Value value_at(const std::uint8_t* bytes) {
    Value value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
}

void set_at(std::uint8_t* bytes, std::uint32_t value) {
    std::memcpy(bytes, &value, sizeof value);
}

/// What both headers of an entry have of it.
std::string entry_fields(bool deflated, const std::string& content, const std::string& kept,
                         const std::string& name) {
    std::string bytes;
    put(bytes, std::uint16_t{20});
    put(bytes, std::uint16_t{0});
    put(bytes, static_cast<std::uint16_t>(deflated ? 8 : 0));
    put(bytes, std::uint32_t{0x00210000});  // 1980-01-01
    put(bytes, checksum_of(content));
    put(bytes, static_cast<std::uint32_t>(kept.size()));
    put(bytes, static_cast<std::uint32_t>(content.size()));
    put(bytes, static_cast<std::uint16_t>(name.size()));
    put(bytes, std::uint16_t{0});
    return bytes;
}

/// \param central  within the archive
void repair_entry(std::uint8_t* bytes, std::size_t size, std::uint8_t* central) {
    const std::size_t local = value_at<std::uint32_t>(central + 42);
    if (local > size || size - local < local_bytes || value_at<std::uint32_t>(bytes + local) != local_mark)
        return;
    const std::size_t begin = local + local_bytes + value_at<std::uint16_t>(bytes + local + 26) +
                              value_at<std::uint16_t>(bytes + local + 28);
    if (begin > size) return;
    const std::size_t kept = std::min<std::size_t>(value_at<std::uint32_t>(central + 20), size - begin);
    std::string content(reinterpret_cast<const char*>(bytes) + begin, kept);
    if (value_at<std::uint16_t>(central + 10) == 8) {
        const auto found = unpacked(bytes + begin, kept);
        if (!found) return;
        content = *found;
    }
    for (std::uint8_t* const fields : {central + 16, bytes + local + 14}) {
        set_at(fields, checksum_of(content));
        set_at(fields + 4, static_cast<std::uint32_t>(kept));
        set_at(fields + 8, static_cast<std::uint32_t>(content.size()));
    }
}

}  // namespace

std::string zip_bytes(const std::vector<std::pair<std::string, std::string>>& files, bool deflated) {
    std::string bytes, directory;
    for (const auto& [name, content] : files) {
        const std::string kept = deflated ? packed(content) : content,
                          fields = entry_fields(deflated, content, kept, name);
        put(directory, central_mark);
        put(directory, std::uint16_t{20});
        directory += fields + std::string(10, '\0');
        put(directory, static_cast<std::uint32_t>(bytes.size()));
        directory += name;
        put(bytes, local_mark);
        bytes += fields + name + kept;
    }
    const auto begin = static_cast<std::uint32_t>(bytes.size());
    bytes += directory;
    put(bytes, end_mark);
    put(bytes, std::uint32_t{0});
    put(bytes, static_cast<std::uint16_t>(files.size()));
    put(bytes, static_cast<std::uint16_t>(files.size()));
    put(bytes, static_cast<std::uint32_t>(directory.size()));
    put(bytes, begin);
    put(bytes, std::uint16_t{0});
    return bytes;
}

void repair_zip(std::uint8_t* bytes, std::size_t size) {
    if (size < end_bytes) return;
    std::size_t end = size - end_bytes;
    while (end > 0 && value_at<std::uint32_t>(bytes + end) != end_mark) --end;
    std::size_t at = value_at<std::uint32_t>(bytes + end + 16);
    while (at < size && size - at >= central_bytes && value_at<std::uint32_t>(bytes + at) == central_mark) {
        repair_entry(bytes, size, bytes + at);
        at += central_bytes + value_at<std::uint16_t>(bytes + at + 28) +
              std::size_t{value_at<std::uint16_t>(bytes + at + 30)} +
              value_at<std::uint16_t>(bytes + at + 32);
    }
}

}  // namespace btfield::test
