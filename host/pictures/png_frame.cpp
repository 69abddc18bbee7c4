#include "host/pictures/png_frame.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/pictures/picture_format.hpp"

namespace btfield::detail {
namespace {

/// Of ISO 3309, as the PNG specification asks for.
std::uint32_t sum_of(std::string_view bytes) {
    return static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::uint32_t word(std::string_view bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (const char c : bytes.substr(at, 4)) value = value << 8 | static_cast<unsigned char>(c);
    return value;
}

void check_header(std::string_view content, std::size_t file_bytes, const std::string& asked) {
    const auto fail = [&](const std::string& found) { throw InputError(asked, found, use_a_complete_file); };
    if (content.size() != 13) fail("its header has a wrong length");
    const std::uint32_t width = word(content, 0);
    const std::uint32_t height = word(content, 4);
    if (width < 1 || height < 1 || width > most_png_pixels || height > most_png_pixels) {
        fail("its header says " + compact_size_text(width, height) + " pixels");
    }
    const int depth = content[8];
    const int colour = content[9];
    const bool bytes = depth == 8 || depth == 16;
    const bool bits = depth == 1 || depth == 2 || depth == 4;
    const bool known = (colour == 0 && (bits || bytes)) || (colour == 3 && (bits || depth == 8)) ||
                       ((colour == 2 || colour == 4 || colour == 6) && bytes);
    if (!known || content[10] != 0 || content[11] != 0 || content[12] < 0 || content[12] > 1) {
        fail("its header names a kind of pixels that PNG does not have");
    }
    constexpr std::array<int, 7> samples{1, 0, 3, 1, 2, 0, 4};  // of each kind of colour
    constexpr double deflate = 1032.0;                          // 258 equal bytes in two bits
    const double row_bytes = std::ceil(width * (samples[static_cast<std::size_t>(colour)] * depth / 8.0));
    check_packing({static_cast<int>(height), static_cast<int>(width)}, row_bytes,
                  static_cast<std::uintmax_t>(file_bytes), asked, deflate);
}

/// Chunks that decide about pixel values. What others say is understood here.
bool matters(std::string_view name) {
    constexpr std::array<std::string_view, 5> kept{"IHDR", "PLTE", "tRNS", "IDAT", "IEND"};
    return std::find(kept.begin(), kept.end(), name) != kept.end();
}

/// The rules of the PNG specification for what stands where, as far as readers differ over it.
class ChunkRules {
  public:
    /// Whether the chunk may stand here and has a length that it can have; in file order, the header first.
    [[nodiscard]] bool allows(std::string_view name, std::string_view content) {
        if (name == "IHDR") colour_ = content[9];
        if (name == "PLTE") palette_ = content.size() / 3;
        if (name == "IDAT") pixels_begun_ = true;
        if (name == "gAMA") return content.size() == 4;
        if (name == "cHRM") return content.size() == 32;
        if (name == "cICP") return content.size() == 4;
        if (name != "tRNS") return true;
        if (pixels_begun_) return false;
        return colour_ == 0   ? content.size() == 2
               : colour_ == 2 ? content.size() == 6
               : colour_ == 3 ? !content.empty() && content.size() <= palette_
                              : false;
    }

  private:
    int colour_ = 0;
    std::size_t palette_ = 0;
    bool pixels_begun_ = false;
};

void keep(PngChunks& chunks, std::string_view name, std::string_view content) {
    const std::array<std::pair<std::string_view, std::string*>, 5> known{{{"gAMA", &chunks.gamma},
                                                                          {"cHRM", &chunks.primaries},
                                                                          {"iCCP", &chunks.profile},
                                                                          {"cICP", &chunks.code_points},
                                                                          {"eXIf", &chunks.exif}}};
    for (const auto& [text, place] : known)
        if (name == text) *place = content;
    constexpr std::string_view description("Description", 12);  // with the zero behind it
    if (name == "tEXt" && content.starts_with(description))
        chunks.description = content.substr(description.size());
    if (name == "iTXt" && content.starts_with(png_xmp_mark)) chunks.xmp = content;
    if (name == "sRGB") chunks.has_srgb = true;
    if (name == "acTL") chunks.animated = true;
}

}  // namespace

std::string checked_png(const std::filesystem::path& path, const std::string& asked, PngChunks* chunks) {
    const std::string bytes = file_content(path);
    const std::string_view all = bytes;
    constexpr std::size_t signature = 8;
    constexpr std::size_t head = 8;  // length, name
    constexpr std::size_t sum = 4;
    std::string kept = bytes.substr(0, signature);
    kept.reserve(bytes.size());
    std::size_t at = signature;
    ChunkRules rules;
    while (at + head <= all.size()) {
        const std::size_t length = word(all, at);
        const std::string_view name = all.substr(at + 4, 4);
        const bool text =
            std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalpha(c) != 0; });
        if (!text) throw InputError(asked, "one of its chunks is damaged", use_a_complete_file);
        const std::string called(name);
        if (length > all.size() - at - head || sum > all.size() - at - head - length) {
            throw InputError(asked,
                             "it ends inside its " + (called == "IDAT" ? "pixel data" : called + " chunk"),
                             use_a_complete_file);
        }
        const std::string_view content = all.substr(at + head, length);
        if (sum_of(all.substr(at + 4, 4 + length)) != word(all, at + head + length)) {
            throw InputError(
                asked, "its " + (called == "IDAT" ? "pixel data is" : called + " chunk is") + " damaged",
                use_a_complete_file);
        }
        if ((name == "IHDR") != (at == signature)) {
            throw InputError(asked, "its header is not at its beginning", use_a_complete_file);
        }
        if (name == "IHDR") check_header(content, bytes.size(), asked);
        const bool critical = std::isupper(static_cast<unsigned char>(name.front())) != 0;
        if (critical && !matters(name)) {
            throw InputError(
                asked, "it is of a kind that is not supported (its chunk " + called + " must not be ignored)",
                convert_it);
        }
        const bool right = rules.allows(name, content);
        if (chunks != nullptr && right) keep(*chunks, name, content);
        if (chunks != nullptr && !right) chunks->damaged += (chunks->damaged.empty() ? "" : ", ") + called;
        if (matters(name) && right) kept.append(all.substr(at, head + length + sum));
        at += head + length + sum;
        if (name != "IEND") continue;
        if (chunks != nullptr) chunks->behind_end = all.size() - at;
        return kept;
    }
    throw InputError(asked, "it ends before its end mark", use_a_complete_file);
}

}  // namespace btfield::detail
