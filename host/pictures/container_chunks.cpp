#include "host/pictures/container_chunks.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace btfield::detail {
namespace {

using Bytes = std::string_view;

/// Most significant byte first; 0 beyond the end.
std::uint64_t number(Bytes bytes, std::size_t at, std::size_t count) {
    std::uint64_t value = 0;
    for (std::size_t i = at; i < at + count; ++i)
        value = value << 8 | (i < bytes.size() ? static_cast<unsigned char>(bytes[i]) : 0U);
    return value;
}

/// A box of ISO/IEC 14496-12.
struct Box {
    Bytes name, content;
};

std::vector<Box> boxes_in(Bytes bytes) {
    std::vector<Box> boxes;
    while (bytes.size() >= 8) {
        std::uint64_t size = number(bytes, 0, 4);
        std::size_t head = 8;
        if (size == 1) {
            size = number(bytes, 8, 8);
            head = 16;
        } else if (size == 0) {
            size = bytes.size();
        }
        if (size < head || size > bytes.size()) break;
        boxes.push_back({bytes.substr(4, 4), bytes.substr(head, size - head)});
        bytes.remove_prefix(size);
    }
    return boxes;
}

/// Content of the first box of this name.
std::optional<Bytes> box_named(const std::vector<Box>& boxes, Bytes name) {
    const auto found = std::find_if(boxes.begin(), boxes.end(), [&](const Box& b) { return b.name == name; });
    return found == boxes.end() ? std::nullopt : std::optional(found->content);
}

/// Behind version and flags.
Bytes fields_of(Bytes full_box) {
    return full_box.substr(std::min<std::size_t>(4, full_box.size()));
}

/// Numbers, from 1, of the item's properties.
std::vector<std::size_t> properties_of(Bytes associations, std::uint64_t item) {
    const std::uint64_t version = number(associations, 0, 1), flags = number(associations, 1, 3);
    const std::size_t id_bytes = version == 0 ? 2 : 4, index_bytes = (flags & 1U) != 0 ? 2 : 1;
    const Bytes fields = fields_of(associations);
    std::size_t at = 4;
    for (std::uint64_t left = number(fields, 0, 4); left > 0 && at < fields.size(); --left) {
        const std::uint64_t id = number(fields, at, id_bytes);
        const std::uint64_t count = number(fields, at + id_bytes, 1);
        at += id_bytes + 1;
        std::vector<std::size_t> result;
        for (std::uint64_t i = 0; i < count; ++i, at += index_bytes)
            result.push_back(number(fields, at, index_bytes) & (index_bytes == 2 ? 0x7fffU : 0x7fU));
        if (id == item) return result;
    }
    return {};
}

/// A picture may have a profile and code points beside each other.
void take_colours(Bytes content, ContainerChunks& chunks) {
    const Bytes kind = content.substr(0, 4);
    const bool profile = kind == "prof" || kind == "rICC";
    if (profile && chunks.profile.empty()) chunks.profile = content.substr(4);
    if (kind == "nclx" && content.size() >= 8 && chunks.code_points.empty())
        chunks.code_points = {content[5], content[7]};
}

}  // namespace

ContainerChunks webp_chunks(std::string_view bytes) {
    ContainerChunks chunks;
    for (std::size_t at = 12; at + 8 <= bytes.size();) {
        std::size_t length = 0;
        for (std::size_t i = 4; i > 0; --i)
            length = length << 8 | static_cast<unsigned char>(bytes[at + 3 + i]);
        const Bytes name = bytes.substr(at, 4), content = bytes.substr(at + 8, length);
        if (name == "ICCP") chunks.profile = content;
        if (name == "XMP ") chunks.xmp = content;
        if (name == "EXIF") {
            constexpr Bytes head("Exif\0\0", 6);
            chunks.exif = content.starts_with(head) ? content.substr(head.size()) : content;
        }
        at += 8 + length + length % 2;
    }
    return chunks;
}

ContainerChunks heif_chunks(std::string_view bytes) {
    ContainerChunks chunks;
    const auto meta = box_named(boxes_in(bytes), "meta");
    if (!meta) return chunks;
    const std::vector<Box> parts = boxes_in(fields_of(*meta));
    const auto properties = box_named(parts, "iprp"), first = box_named(parts, "pitm");
    if (!properties) return chunks;
    const std::vector<Box> tables = boxes_in(*properties);
    const auto list = box_named(tables, "ipco"), associations = box_named(tables, "ipma");
    if (!list) return chunks;
    const std::vector<Box> all = boxes_in(*list);
    if (first && associations) {
        const std::uint64_t item = number(*first, 4, number(*first, 0, 1) == 0 ? 2 : 4);
        for (const std::size_t index : properties_of(*associations, item))
            if (index >= 1 && index <= all.size() && all[index - 1].name == "colr")
                take_colours(all[index - 1].content, chunks);
    }
    const bool found = !chunks.profile.empty() || !chunks.code_points.empty();
    for (const Box& box : all)
        if (!found && box.name == "colr") take_colours(box.content, chunks);
    return chunks;
}

}  // namespace btfield::detail
