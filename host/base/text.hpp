#pragma once

// Sizes and offsets as people read them. A size has a height and a width, an offset a row and a column,
// whatever its type: this room knows neither Size nor Offset.

#include <string>
#include <string_view>

namespace btfield::detail {

/// "1 plane", "3 planes".
template <typename Count>
[[nodiscard]] std::string counted(Count count, std::string_view noun) {
    return std::to_string(count) + " " + std::string(noun) + (count == 1 ? "" : "s");
}

/// "320 x 256": width first, as everywhere where pictures are measured.
template <typename Size>
requires requires(const Size& size) {
    size.width, size.height;
}
[[nodiscard]] std::string text_of(const Size& size) {
    return std::to_string(size.width) + " x " + std::to_string(size.height);
}

/// "320x256", as --size takes it.
template <typename Side>
[[nodiscard]] std::string compact_size_text(Side width, Side height) {
    return std::to_string(width) + "x" + std::to_string(height);
}
template <typename Size>
requires requires(const Size& size) {
    size.width, size.height;
}
[[nodiscard]] std::string compact_text_of(const Size& size) {
    return compact_size_text(size.width, size.height);
}

/// The text with every byte that is not part of well-formed UTF-8 (RFC 3629) replaced by U+FFFD: names of
/// files and planes are bytes, JSON and CBOR hold text.
[[nodiscard]] std::string valid_utf8(std::string_view text);

/// The text as HTML and SVG show it: &, <, > and quotes are written as entities.
[[nodiscard]] std::string html_text(std::string_view text);

/// "(row, column)"
template <typename Offset>
requires requires(const Offset& offset) {
    offset.row, offset.column;
}
[[nodiscard]] std::string text_of(const Offset& offset) {
    return "(" + std::to_string(offset.row) + ", " + std::to_string(offset.column) + ")";
}

}  // namespace btfield::detail
