#include "host/pictures/picture_format.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <iterator>
#include <system_error>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/text.hpp"

namespace btfield::detail {
namespace {

struct Traits {
    PictureFormat format;
    std::string_view codec;  ///< OpenImageIO's name
    std::string_view title;  ///< name for people
    int most_planes;
    std::array<bool, 4> holds;  ///< by PixelType
};

// Alpha is not written, so formats whose second or fourth channel is alpha hold one or three planes. TIFF
// counts samples in 16 bits; the limit for EXR only keeps channel names short.
constexpr std::array<Traits, 6> all_traits{{
    {PictureFormat::png, "png", "PNG", 3, {true, true, false, false}},
    {PictureFormat::jpeg, "jpeg", "JPEG", 3, {true, false, false, false}},
    {PictureFormat::tiff, "tiff", "TIFF", 65535, {true, true, true, true}},
    {PictureFormat::exr, "openexr", "EXR", 65535, {false, false, true, true}},
    {PictureFormat::hdr, "hdr", "HDR", 3, {false, false, false, true}},
    {PictureFormat::pnm, "pnm", "PNM", 3, {true, true, false, false}},
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

std::uint32_t big_endian(const char* bytes, int count) {
    std::uint32_t value = 0;
    for (int i = 0; i < count; ++i) value = value << 8 | static_cast<unsigned char>(bytes[i]);
    return value;
}

}  // namespace

std::string_view codec_name(PictureFormat format) {
    return traits(format).codec;
}

std::optional<PictureFormat> format_of_bytes(std::string_view head) {
    using namespace std::string_view_literals;
    if (head.starts_with("\x89PNG\r\n\x1a\n"sv)) return PictureFormat::png;
    if (head.starts_with("\xff\xd8\xff"sv)) return PictureFormat::jpeg;
    for (const auto magic : {"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv}) {
        if (head.starts_with(magic)) return PictureFormat::tiff;
    }
    if (head.starts_with("\x76\x2f\x31\x01"sv)) return PictureFormat::exr;
    if (head.starts_with("#?RADIANCE"sv) || head.starts_with("#?RGBE"sv)) return PictureFormat::hdr;
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
    constexpr const char* use_a_picture = "give a PNG, JPEG, TIFF, EXR, HDR or PNM picture";
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
    std::array<char, 16> head{};
    file.read(head.data(), head.size());
    const auto format = format_of_bytes({head.data(), static_cast<std::size_t>(file.gcount())});
    if (!format) throw InputError(asked, "it is not a picture of a known format", use_a_picture);
    return *format;
}

void check_packing(Size size, double row_bytes, std::uintmax_t file_bytes, const std::string& asked) {
    // No codec packs this well (zlib: 1032, zstd runs: 32768), so the pixels cannot be there.
    constexpr double best_packing = 65536.0;
    if (!(row_bytes * size.height <= best_packing * static_cast<double>(file_bytes))) {
        throw InputError(asked,
                         "its header says " + compact_text_of(size) + " pixels, which " +
                             std::to_string(file_bytes) + " bytes cannot hold",
                         use_a_complete_file);
    }
}

std::string jpeg_missing_end(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    const std::vector<char> data{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(data[i]); };
    constexpr int end_of_image = 0xD9;
    constexpr int start_of_scan = 0xDA;
    std::size_t at = 2;
    bool in_scan = false;
    while (at + 1 < data.size()) {
        if (byte(at) != 0xFF || byte(at + 1) == 0xFF) {  // entropy-coded data, or fill before a marker
            ++at;
            continue;
        }
        const int marker = byte(at + 1);
        at += 2;
        if (marker == end_of_image) return {};
        // 0x00 escapes a data byte of 0xFF; restart marks (and 0x01) stand alone.
        if (marker <= 0x01 || (marker >= 0xD0 && marker <= 0xD7)) continue;
        if (at + 1 >= data.size()) break;
        in_scan = in_scan || marker == start_of_scan;
        at += big_endian(data.data() + at, 2);
    }
    return in_scan ? "it ends inside its pixel data" : "it ends inside its header";
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

Storage storage_for(const std::filesystem::path& path, int planes, PixelType source,
                    std::optional<PixelType> type, const std::string& asked) {
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    const auto* const entry = std::find_if(extensions.begin(), extensions.end(),
                                           [&](const Extension& e) { return e.text == extension; });
    if (entry == extensions.end()) {
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
            asked,
            "the picture has " + std::to_string(planes) + " planes and " + extension + " holds " + holds,
            "use .tif or .exr, which hold any number");
    }

    if (!type) {
        switch (entry->format) {
            case PictureFormat::exr:
                type = PixelType::half;
                break;
            case PictureFormat::hdr:
                type = PixelType::float32;
                break;
            case PictureFormat::tiff:
                type = source;
                break;
            case PictureFormat::jpeg:
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
    return {entry->format, *type};
}

}  // namespace btfield::detail
