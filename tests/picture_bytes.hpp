#pragma once

// Pictures put together byte by byte: what no writer at hand would write, or not without adding to it.

#include <zlib.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "btfield/image.hpp"

namespace btfield::test {

/// Most significant byte first.
inline std::string big_endian(std::uint32_t value, int bytes = 4) {
    std::string text;
    for (int i = bytes - 1; i >= 0; --i) text += static_cast<char>(value >> (8 * i) & 255U);
    return text;
}

inline std::string little_endian(std::uint32_t value, int bytes = 4) {
    const std::string text = big_endian(value, bytes);
    return {text.rbegin(), text.rend()};
}

inline std::string deflated(std::string_view bytes) {
    std::string packed(compressBound(bytes.size()), '\0');
    uLongf length = packed.size();
    compress(reinterpret_cast<Bytef*>(packed.data()), &length, reinterpret_cast<const Bytef*>(bytes.data()),
             bytes.size());
    packed.resize(length);
    return packed;
}

inline std::string png_chunk(const std::string& name, const std::string& content) {
    const std::string body = name + content;
    const auto sum = crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
    return big_endian(static_cast<std::uint32_t>(content.size())) + body +
           big_endian(static_cast<std::uint32_t>(sum));
}

/// 8 bits, grey (0) or RGB (2); `chunks` stand before the pixels.
inline std::string png_bytes(Size size, int colour, const std::string& pixels,
                             const std::string& chunks = {}) {
    const std::size_t row = static_cast<std::size_t>(size.width) * (colour == 2 ? 3 : 1);
    std::string rows;
    for (std::size_t at = 0; at < pixels.size(); at += row) rows += '\0' + pixels.substr(at, row);
    std::string header = big_endian(static_cast<std::uint32_t>(size.width)) +
                         big_endian(static_cast<std::uint32_t>(size.height));
    header += std::string{'\10', static_cast<char>(colour), '\0', '\0', '\0'};
    return "\x89PNG\r\n\x1a\n" + png_chunk("IHDR", header) + chunks + png_chunk("IDAT", deflated(rows)) +
           png_chunk("IEND", "");
}

/// A tag of words (type 3).
using TiffTag = std::pair<std::uint16_t, std::vector<std::uint16_t>>;

/// Pixels in one strip, and the list of tags behind them.
/// \param at where the bytes will stand in the file
inline std::string tiff_directory(Size size, const std::vector<TiffTag>& tags, const std::string& pixels,
                                  std::size_t at) {
    struct Entry {
        std::uint16_t tag;
        std::string bytes;
    };
    const auto entry = [](std::uint16_t tag, int type, std::size_t count, const std::string& value) {
        return Entry{tag, little_endian(tag, 2) + little_endian(static_cast<std::uint32_t>(type), 2) +
                              little_endian(static_cast<std::uint32_t>(count)) + value};
    };
    const std::size_t pixels_at = at, list_at = at + pixels.size() + pixels.size() % 2;
    const std::size_t count = tags.size() + 5;
    const std::size_t extra_at = list_at + 2 + 12 * count + 4;
    std::string extra;
    std::vector<Entry> entries;
    const auto long_entry = [&](std::uint16_t tag, std::size_t value) {
        entries.push_back(entry(tag, 4, 1, little_endian(static_cast<std::uint32_t>(value))));
    };
    long_entry(256, static_cast<std::size_t>(size.width));
    long_entry(257, static_cast<std::size_t>(size.height));
    long_entry(273, pixels_at);
    long_entry(278, static_cast<std::size_t>(size.height));
    long_entry(279, pixels.size());
    for (const auto& [tag, words] : tags) {
        std::string value;
        for (const std::uint16_t word : words) value += little_endian(word, 2);
        if (value.size() > 4) {
            const std::string place = little_endian(static_cast<std::uint32_t>(extra_at + extra.size()));
            extra += value;
            value = place;
        }
        value.resize(4, '\0');
        entries.push_back(entry(tag, 3, words.size(), value));
    }
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.tag < b.tag; });
    std::string bytes = pixels;
    bytes.resize(list_at - at, '\0');
    bytes += little_endian(static_cast<std::uint32_t>(count), 2);
    for (const Entry& each : entries) bytes += each.bytes;
    const std::size_t end = extra_at + extra.size() + (extra.size() % 2);
    bytes += little_endian(0) + extra;
    bytes.resize(end - at, '\0');
    return bytes;
}

/// A TIFF of one picture.
inline std::string tiff_bytes(Size size, const std::vector<TiffTag>& tags, const std::string& pixels) {
    const std::string rest = tiff_directory(size, tags, pixels, 8);
    const std::size_t list = 8 + pixels.size() + pixels.size() % 2;
    return "II*" + std::string(1, '\0') + little_endian(static_cast<std::uint32_t>(list)) + rest;
}

/// EXIF that says nothing but an orientation.
inline std::string exif_bytes(int orientation) {
    return "II*" + std::string(1, '\0') + little_endian(8) + little_endian(1, 2) + little_endian(0x0112, 2) +
           little_endian(3, 2) + little_endian(1) + little_endian(static_cast<std::uint32_t>(orientation)) +
           little_endian(0);
}

}  // namespace btfield::test
