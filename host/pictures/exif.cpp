#include "host/pictures/exif.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace btfield::detail {
namespace {

class TagReader {
  public:
    explicit TagReader(std::string_view block) : block_(block), big_(block.starts_with("MM")) {}

    [[nodiscard]] std::optional<std::uint32_t> number(std::size_t at, std::size_t bytes) const {
        if (at > block_.size() || bytes > block_.size() - at) return std::nullopt;
        std::uint32_t value = 0;
        for (std::size_t i = 0; i < bytes; ++i) {
            const std::size_t place = big_ ? at + i : at + bytes - 1 - i;
            value = value << 8 | static_cast<unsigned char>(block_[place]);
        }
        return value;
    }

    /// Where the value of a tag stands in the list at `list`; values of up to four bytes stand there
    /// themselves.
    [[nodiscard]] std::optional<std::size_t> find(std::uint32_t list, std::uint32_t tag) const {
        const auto count = number(list, 2);
        if (!count) return std::nullopt;
        for (std::uint32_t i = 0; i < *count; ++i) {
            const std::size_t entry = std::size_t{list} + 2 + std::size_t{12} * i;
            const auto found = number(entry, 2);
            if (!found) return std::nullopt;
            if (*found == tag) return entry + 8;
        }
        return std::nullopt;
    }

    [[nodiscard]] std::optional<std::uint32_t> list_below(std::uint32_t list, std::uint32_t tag) const {
        const auto at = find(list, tag);
        return at ? number(*at, 4) : std::nullopt;
    }

  private:
    std::string_view block_;
    bool big_;
};

}  // namespace

Exif read_exif(std::string_view block) {
    Exif result;
    if (!block.starts_with("II") && !block.starts_with("MM")) return result;
    const TagReader tags(block);
    const auto first = tags.number(4, 4);
    if (!first) return result;
    if (const auto at = tags.find(*first, 0x0112)) {
        const auto value = tags.number(*at, 2);
        if (value && *value >= 1 && *value <= 8) {
            result.orientation = static_cast<int>(*value);
            result.has_orientation = true;
        }
    }
    const auto camera = tags.list_below(*first, 0x8769);
    const auto interoperability = camera ? tags.list_below(*camera, 0xA005) : std::nullopt;
    if (interoperability) {
        const auto at = tags.find(*interoperability, 1);
        result.adobe_rgb = at && block.substr(std::min(*at, block.size())).starts_with("R03");
    }
    return result;
}

void take_xmp(Exif& exif, std::string_view packet) {
    constexpr std::string_view key = "tiff:Orientation";
    const std::size_t at = packet.find(key);
    if (exif.has_orientation || at == std::string_view::npos) return;
    std::string_view rest = packet.substr(at + key.size());
    // An attribute, ="6", or an element, >6<.
    const std::size_t digit = rest.find_first_not_of(" \t\r\n=\"'>");
    if (digit == 0 || digit == std::string_view::npos || digit > 8) return;
    const char value = rest[digit];
    const bool ends = digit + 1 == rest.size() || rest[digit + 1] < '0' || rest[digit + 1] > '9';
    if (value < '1' || value > '8' || !ends) return;
    exif.orientation = value - '0';
    exif.from_xmp = value != '1';
}

}  // namespace btfield::detail
