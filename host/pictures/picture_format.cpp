#include "host/pictures/picture_format.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <fstream>
#include <iterator>
#include <limits>
#include <system_error>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/pictures/colour.hpp"
#include "host/pictures/picture_names.hpp"

namespace btfield::detail {
namespace {

struct Traits {
    PictureFormat format;
    std::string_view codec;  ///< OpenImageIO's name
    std::string_view title;  ///< name for people
    int most_planes;
    int longest_side;
    std::array<bool, 4> holds;  ///< by PixelType
};

// Alpha is not written, so formats whose second or fourth channel is alpha hold one or three planes. TIFF
// counts samples in 16 bits; the limit for EXR only keeps channel names short. libjpeg ends the process where
// a side is beyond 65500; libpng, which nearly all programs read PNG with, refuses sides beyond a million.
constexpr int any_side = std::numeric_limits<int>::max();
constexpr std::array<Traits, 8> all_traits{{
    {PictureFormat::png, "png", "PNG", 3, 1000000, {true, true, false, false}},
    {PictureFormat::jpeg, "jpeg", "JPEG", 3, 65500, {true, false, false, false}},
    {PictureFormat::tiff, "tiff", "TIFF", 65535, any_side, {true, true, true, true}},
    {PictureFormat::exr, "openexr", "EXR", 65535, any_side, {false, false, true, true}},
    {PictureFormat::hdr, "hdr", "HDR", 3, any_side, {false, false, false, true}},
    {PictureFormat::pnm, "pnm", "PNM", 3, any_side, {true, true, false, false}},
    {PictureFormat::webp, "webp", "WebP", 0, 16383, {}},
    {PictureFormat::heif, "heif", "HEIF", 0, any_side, {}},
}};

struct Extension {
    std::string_view text;
    PictureFormat format;
    std::array<int, 2> planes;  ///< the only numbers of planes that it allows; 0: any that the format holds
};

constexpr std::array<Extension, 13> extensions{{
    {".png", PictureFormat::png, {1, 3}},
    {".jpg", PictureFormat::jpeg, {1, 3}},
    {".jpeg", PictureFormat::jpeg, {1, 3}},
    {".jpe", PictureFormat::jpeg, {1, 3}},
    {".tif", PictureFormat::tiff, {0, 0}},
    {".tiff", PictureFormat::tiff, {0, 0}},
    {".exr", PictureFormat::exr, {0, 0}},
    {".hdr", PictureFormat::hdr, {3, 3}},
    {".rgbe", PictureFormat::hdr, {3, 3}},
    {".pic", PictureFormat::hdr, {3, 3}},
    {".pgm", PictureFormat::pnm, {1, 1}},
    {".ppm", PictureFormat::pnm, {3, 3}},
    {".pnm", PictureFormat::pnm, {1, 3}},
}};

const Traits& traits(PictureFormat format) {
    return all_traits.at(static_cast<std::size_t>(format));
}

std::string lower_extension_of(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return extension;
}

/// Null where it is unknown.
const Extension* find_extension(std::string_view extension) {
    const auto* const entry = std::ranges::find(extensions, extension, &Extension::text);
    return entry == extensions.end() ? nullptr : entry;
}

}  // namespace

std::optional<PictureFormat> format_of_name(const std::filesystem::path& path) {
    const Extension* const entry = find_extension(lower_extension_of(path));
    return entry == nullptr ? std::nullopt : std::optional(entry->format);
}

bool says_unsupported(std::string_view message) {
    std::string small(message);
    std::transform(small.begin(), small.end(), small.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    constexpr std::array<std::string_view, 17> words{"not supported",
                                                     "unsupported",
                                                     "not implemented",
                                                     "don't support",
                                                     "can't handle",
                                                     "cannot handle",
                                                     "can not handle",
                                                     "not allowed",
                                                     "only supports",
                                                     "supports only",
                                                     "must be 1 for",
                                                     "requires 8 bit",
                                                     "not configured",
                                                     "different values per sample",
                                                     "inappropriate photometric",
                                                     "data precision",
                                                     "don't know how to handle"};
    return std::ranges::any_of(words,
                               [&](std::string_view word) { return small.find(word) != std::string::npos; });
}

std::string_view codec_name(PictureFormat format) {
    return traits(format).codec;
}

std::optional<std::vector<ColourSpace>> said_spaces(std::string_view description, int planes) {
    const std::size_t at = description.find(space_mark);
    if (at == std::string_view::npos || planes < 1) return std::nullopt;
    std::string_view said = description.substr(at + space_mark.size());
    said = said.substr(0, said.find('\n'));
    std::vector<ColourSpace> spaces;
    while (!said.empty()) {
        const std::string_view word = said.substr(0, said.find(' '));
        said.remove_prefix(std::min(word.size() + 1, said.size()));
        const auto space = find_value<ColourSpace>(word);
        if (!space) break;
        spaces.push_back(*space);
    }
    const auto count = static_cast<std::size_t>(planes);
    if (spaces.size() == 1) spaces.resize(count, spaces.front());
    if (spaces.size() != count || !defect_of(spaces, planes).empty()) return std::nullopt;
    return spaces;
}

std::optional<ColourSpace> said_space(std::string_view description) {
    const auto spaces = said_spaces(description, 3);
    if (!spaces) return std::nullopt;
    const bool alike = spaces->at(0) == spaces->at(1) && spaces->at(0) == spaces->at(2);
    return alike ? spaces->front() : ColourSpace::unspecified;
}

std::vector<std::string> said_names(std::string_view description) {
    const std::size_t at = description.find(names_mark);
    if (at == std::string_view::npos) return {};
    std::string_view rest = description.substr(at + names_mark.size());
    std::size_t count = 0;
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), count);
    if (error != std::errc()) return {};
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    std::vector<std::string> names;
    while (names.size() < count && rest.starts_with('\n')) {
        rest.remove_prefix(1);
        const std::size_t line = std::min(rest.find('\n'), rest.size());
        names.push_back(valid_utf8(rest.substr(0, line)));
        rest.remove_prefix(line);
    }
    if (names.size() != count) names.clear();
    return names;
}

namespace {

/// JSON or CBOR whose format, its first member, is one of btfield's.
bool is_model(std::string_view begin) {
    const std::size_t name = begin.find("btfield");
    const bool map = !begin.empty() && (begin.front() == '{' || (begin.front() & 0xe0) == 0xa0);
    return map && name != std::string_view::npos &&
           begin.substr(0, name).find("format") != std::string_view::npos;
}

}  // namespace

std::optional<PictureFormat> format_of_bytes(std::string_view head) {
    using namespace std::string_view_literals;
    if (head.starts_with("\x89PNG\r\n\x1a\n"sv)) return PictureFormat::png;
    if (head.starts_with("\xff\xd8\xff"sv)) return PictureFormat::jpeg;
    for (const auto magic : {"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv}) {
        if (head.starts_with(magic)) return PictureFormat::tiff;
    }
    if (head.starts_with("\x76\x2f\x31\x01"sv)) return PictureFormat::exr;
    if (head.starts_with("#?RADIANCE"sv) || head.starts_with("#?RGBE"sv)) return PictureFormat::hdr;
    if (head.size() >= 12 && head.starts_with("RIFF") && head.substr(8, 4) == "WEBP")
        return PictureFormat::webp;
    if (head.size() >= 12 && head.substr(4, 4) == "ftyp") {
        for (const auto brand : {"heic"sv, "heix"sv, "heim"sv, "heis"sv, "mif1"sv, "msf1"sv, "avif"sv})
            if (head.substr(8, 4) == brand) return PictureFormat::heif;
    }
    // P1 to P6, then white space or a comment: "P5" alone begins many a text.
    if (head.size() > 2 && head[0] == 'P' && head[1] >= '1' && head[1] <= '6' &&
        (std::isspace(static_cast<unsigned char>(head[2])) != 0 || head[2] == '#')) {
        return PictureFormat::pnm;
    }
    return std::nullopt;
}

PictureFormat checked_format(const std::filesystem::path& path, const std::string& asked,
                             std::uintmax_t& bytes) {
    namespace fs = std::filesystem;
    constexpr const char* use_a_picture = "give a PNG, JPEG, TIFF, EXR, HDR, PNM, WebP or HEIC picture";
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (status.type() == fs::file_type::not_found) {
        throw InputError(asked, "there is no such file", "check the name");
    }
    if (status.type() == fs::file_type::directory) throw InputError(asked, "it is a folder", use_a_picture);
    if (status.type() == fs::file_type::none)
        throw InputError(asked, error.message(), "check the permissions");
    if (status.type() != fs::file_type::regular) {
        throw InputError(asked, "it is a device or a pipe", "store the picture in a file first");
    }
    bytes = fs::file_size(path, error);
    if (error) throw InputError(asked, error.message(), "check the permissions");
    if (bytes == 0) throw InputError(asked, "the file is empty", use_a_complete_file);

    std::ifstream file(path, std::ios::binary);
    if (!file) throw InputError(asked, "the file cannot be opened", "check the permissions");
    std::array<char, 64> head{};
    file.read(head.data(), head.size());
    const std::string_view begin(head.data(), static_cast<std::size_t>(file.gcount()));
    const auto format = format_of_bytes(begin);
    if (!format && is_model(begin))
        throw InputError(asked, "it is a model of btfield, not a picture",
                         "grow a picture of it first, with 'btfield " +
                             std::string(begin.find("btfield-btf") < begin.size() ? "btf synth" : "synth") +
                             "'");
    if (!format) throw InputError(asked, "it is not a picture of a known format", use_a_picture);
    return *format;
}

std::string file_content(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void check_packing(Size size, double row_bytes, std::uintmax_t file_bytes, const std::string& asked,
                   double best_packing) {
    if (!(row_bytes * size.height <= best_packing * static_cast<double>(file_bytes))) {
        throw InputError(asked,
                         "its header says " + compact_text_of(size) + " pixels, which " +
                             std::to_string(file_bytes) + " bytes cannot hold",
                         use_a_complete_file);
    }
}

Crop checked_crop(const std::optional<Crop>& crop, Size size, const std::string& asked) {
    if (!crop) return {0, 0, size.width, size.height};
    const bool inside = crop->x >= 0 && crop->y >= 0 && crop->width > 0 && crop->height > 0 &&
                        crop->x < size.width && crop->y < size.height &&
                        crop->width <= size.width - crop->x && crop->height <= size.height - crop->y;
    if (!inside) {
        throw InputError(asked,
                         "the crop " + std::to_string(crop->x) + "," + std::to_string(crop->y) + "," +
                             std::to_string(crop->width) + "," + std::to_string(crop->height) +
                             " is empty or leaves the picture of " + compact_text_of(size) + " pixels",
                         "give X,Y,W,H inside the picture");
    }
    return *crop;
}

int chosen_part(const std::vector<Part>& parts, const std::string& wanted, const std::string& asked) {
    std::string list;
    constexpr std::size_t most = 20;
    for (std::size_t i = 0; i < parts.size() && i < most; ++i) {
        list += (i > 0 ? ", " : "") + std::to_string(i);
        if (!parts[i].name.empty()) list += " '" + valid_utf8(parts[i].name) + "'";
        list += " (" + parts[i].what + (parts[i].reduced ? ", a reduced copy or mask)" : ")");
    }
    if (parts.size() > most) list += ", ...";
    if (!wanted.empty()) {
        for (std::size_t i = 0; i < parts.size(); ++i)
            if (parts[i].name == wanted) return static_cast<int>(i);
        int number = 0;
        const char* const last = wanted.data() + wanted.size();
        const auto [end, error] = std::from_chars(wanted.data(), last, number);
        if (error == std::errc() && end == last && number >= 0 && number < static_cast<int>(parts.size()))
            return number;
        throw InputError(asked, "it has no part '" + wanted + "'", "choose from " + list);
    }
    std::vector<int> full;
    for (std::size_t i = 0; i < parts.size(); ++i)
        if (!parts[i].reduced) full.push_back(static_cast<int>(i));
    if (full.size() == 1) return full.front();
    if (parts.size() == 1) return 0;
    throw InputError(asked, "it holds several pictures: " + list, "choose one by number or name with --part");
}

Storage storage_for(const std::filesystem::path& path, int planes, PixelType source,
                    std::optional<PixelType> type, const std::string& asked) {
    const std::string extension = lower_extension_of(path);
    const Extension* const entry = find_extension(extension);
    if (entry == nullptr) {
        throw InputError(asked,
                         extension.empty() ? "the name has no extension" : "'" + extension + "' is not known",
                         "end the name in .png, .jpg, .tif, .exr, .hdr, .pgm, .ppm or .pnm");
    }
    const Traits& format = traits(entry->format);

    const bool any = entry->planes[0] == 0;
    const bool fits = planes >= 1 && (any ? planes <= format.most_planes
                                          : planes == entry->planes[0] || planes == entry->planes[1]);
    if (!fits) {
        std::string holds =
            any ? "1 to " + std::to_string(format.most_planes) : std::to_string(entry->planes[0]);
        if (!any && entry->planes[1] != entry->planes[0]) holds += " or " + std::to_string(entry->planes[1]);
        throw InputError(
            asked, "the picture has " + counted(planes, "plane") + " and " + extension + " holds " + holds,
            "use .tif or .exr, which hold any number");
    }

    if (!type) {
        switch (entry->format) {
            case PictureFormat::exr:  // half keeps 8 bits in linear light, not 16
                type = source == PixelType::uint8 || source == PixelType::half ? PixelType::half
                                                                               : PixelType::float32;
                break;
            case PictureFormat::hdr:
                type = PixelType::float32;
                break;
            case PictureFormat::tiff:
                type = source;
                break;
            case PictureFormat::jpeg:
            case PictureFormat::webp:  // read only: no extension leads here
            case PictureFormat::heif:
                type = PixelType::uint8;
                break;
            case PictureFormat::png:
            case PictureFormat::pnm:
                type = source == PixelType::uint8 ? PixelType::uint8 : PixelType::uint16;
                break;
        }
    }
    if (!format.holds.at(static_cast<std::size_t>(*type))) {
        std::string holds;
        for (std::size_t i = 0; i < format.holds.size(); ++i) {
            if (format.holds.at(i))
                holds += (holds.empty() ? "" : ", ") + std::string(name(static_cast<PixelType>(i)));
        }
        throw InputError(
            asked, std::string(format.title) + " cannot hold " + std::string(name(*type)) + ", only " + holds,
            "choose another type or extension");
    }
    return {entry->format, *type, {}};
}

void check_sides(PictureFormat format, Size size, const std::string& asked) {
    const Traits& own = traits(format);
    if (std::max(size.height, size.width) <= own.longest_side) return;
    throw InputError(
        asked + " with " + text_of(size) + " pixels",
        std::string(own.title) + " holds sides up to " + std::to_string(own.longest_side) + " pixels",
        "choose .tif or .exr, which hold any, or a smaller size");
}

}  // namespace btfield::detail
