#include "host/pictures/oiio/exr_header.hpp"

#include <array>
#include <fstream>
#include <optional>

#include "btfield/error.hpp"
#include "host/pictures/picture_format.hpp"

namespace btfield::detail {
namespace {

constexpr std::size_t longest_name = 255;

/// Up to its null; none where the file ends before, or where it is too long to be one.
std::optional<std::string> read_name(std::istream& file) {
    std::string name;
    for (char c = 0; file.get(c);) {
        if (c == '\0') return name;
        if (name.size() == longest_name) break;
        name.push_back(c);
    }
    return {};
}

std::optional<std::uint32_t> read_word(std::istream& file) {
    std::array<char, 4> bytes{};
    if (!file.read(bytes.data(), bytes.size())) return {};
    std::uint32_t value = 0;
    for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[i]);
    return value;
}

}  // namespace

void check_exr_header(const std::filesystem::path& path, std::uintmax_t file_bytes,
                      const std::string& asked) {
    constexpr std::streamoff version = 4;  // after the mark
    constexpr std::uint32_t several_parts = 0x1000;
    std::ifstream file(path, std::ios::binary);
    file.seekg(version);
    const std::optional<std::uint32_t> flags = read_word(file);
    const bool single = !flags || (*flags & several_parts) == 0;
    // An empty name ends a header; in a file of several parts, two in a row end the last.
    for (bool ended = false; file;) {
        const std::optional<std::string> name = read_name(file);
        if (!name || (name->empty() && (ended || single))) return;
        ended = name->empty();
        if (ended) continue;
        const std::optional<std::string> type = read_name(file);
        const std::optional<std::uint32_t> bytes = type ? read_word(file) : std::nullopt;
        if (!bytes) return;
        const auto rest = file_bytes - static_cast<std::uintmax_t>(file.tellg());
        if (*bytes > rest)
            throw InputError(asked,
                             "its header's '" + *name + "' claims " + std::to_string(*bytes) +
                                 " bytes, where " + std::to_string(rest) + " are left",
                             use_a_complete_file);
        file.seekg(*bytes, std::ios::cur);
    }
}

}  // namespace btfield::detail
