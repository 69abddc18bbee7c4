#include "host/pictures/oiio/tiff_file.hpp"

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <fstream>

#include "btfield/error.hpp"
#include "host/base/text.hpp"

namespace btfield::detail {
namespace {

/// libtiff would print it. The first error is the cause of the others.
int keep_message(TIFF* /*tiff*/, void* to, const char* /*module*/, const char* format, va_list arguments) {
    auto& message = *static_cast<std::string*>(to);
    std::array<char, 256> text{};
    std::vsnprintf(text.data(), text.size(), format, arguments);
    if (message.empty()) message = valid_utf8(text.data());
    std::ranges::replace(message, '\n', ' ');
    return 1;
}

int drop_message(TIFF* /*tiff*/, void* /*to*/, const char* /*module*/, const char* /*format*/,
                 va_list /*arguments*/) {
    return 1;
}

struct FreeOptions {
    void operator()(TIFFOpenOptions* options) const { TIFFOpenOptionsFree(options); }
};
TiffDirectory directory_of(TIFF* tiff) {
    const TiffLayout layout = tiff_layout(tiff);
    TiffDirectory result;
    result.offset = TIFFCurrentDirOffset(tiff);
    if (const auto name = tiff_field<const char*>(tiff, TIFFTAG_PAGENAME))
        result.part.name = valid_utf8(*name);
    result.part.what = compact_text_of(layout.size) + ", " + std::to_string(layout.samples) +
                       (layout.samples == 1 ? " sample" : " samples");
    const std::uint32_t kind = tiff_field<std::uint32_t>(tiff, TIFFTAG_SUBFILETYPE).value_or(0);
    const std::uint16_t old_kind = tiff_field<std::uint16_t>(tiff, TIFFTAG_OSUBFILETYPE).value_or(0);
    result.part.reduced =
        (kind & (FILETYPE_REDUCEDIMAGE | FILETYPE_MASK)) != 0 || old_kind == OFILETYPE_REDUCEDIMAGE;
    return result;
}

/// L*a*b* of bits that its encoding does not have.
bool lacks_lab(const TiffLayout& layout) {
    const bool lab = layout.photometric == PHOTOMETRIC_CIELAB || layout.photometric == PHOTOMETRIC_ICCLAB;
    const bool whole = layout.is_fraction() && (layout.bits == 8 || layout.bits == 16);
    return lab && !layout.is_float() && !whole;
}

}  // namespace

Tiff open_tiff(const std::filesystem::path& path, std::string& message) {
    // What codecs say without a file at hand.
    TIFFSetErrorHandler(nullptr);
    TIFFSetWarningHandler(nullptr);
    const std::unique_ptr<TIFFOpenOptions, FreeOptions> options(TIFFOpenOptionsAlloc());
    TIFFOpenOptionsSetErrorHandlerExtR(options.get(), &keep_message, &message);
    TIFFOpenOptionsSetWarningHandlerExtR(options.get(), &drop_message, nullptr);
    TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), tmsize_t{1} << 32);
    return Tiff(TIFFOpenExt(path.c_str(), "rm", options.get()));
}

std::uint16_t tiff_word(TIFF* tiff, std::uint32_t tag, std::uint16_t otherwise) {
    std::uint16_t value = 0;
    return TIFFGetFieldDefaulted(tiff, tag, &value) == 1 ? value : otherwise;
}

std::optional<std::string> tiff_text(TIFF* tiff, std::uint32_t tag) {
    std::uint32_t count = 0;
    const char* text = nullptr;
    const TIFFField* const known = TIFFFindField(tiff, tag, TIFF_ASCII);
    if (known == nullptr || TIFFFieldPassCount(known) == 0) return std::nullopt;
    if (TIFFGetField(tiff, tag, &count, &text) != 1 || text == nullptr) return std::nullopt;
    const std::string_view all(text, count);
    return valid_utf8(all.substr(0, all.find('\0')));
}

bool has_tiff_tag(TIFF* tiff, std::uint32_t tag) {
    std::uint32_t count = 0;
    const void* values = nullptr;
    const TIFFField* const known = TIFFFindField(tiff, tag, TIFF_ANY);
    return known != nullptr && TIFFFieldPassCount(known) != 0 &&
           TIFFGetField(tiff, tag, &count, &values) == 1;
}

std::optional<std::uint32_t> stored_tiff_word(const std::filesystem::path& path, std::uint64_t offset,
                                              std::uint16_t tag) {
    std::ifstream file(path, std::ios::binary);
    std::array<char, 20> bytes{};
    if (!file.read(bytes.data(), 8)) return std::nullopt;
    const bool big = bytes[0] == 'M';
    const auto number = [&](std::size_t at, std::size_t count) {
        std::uint64_t value = 0;
        for (std::size_t i = 0; i < count; ++i)
            value = value << 8 | static_cast<std::uint8_t>(bytes.at(big ? at + i : at + count - 1 - i));
        return value;
    };
    const bool wide = number(2, 2) == 43;
    const std::size_t head = wide ? 8 : 2, entry = wide ? 20 : 12;
    file.seekg(static_cast<std::streamoff>(offset));
    if (!file.read(bytes.data(), static_cast<std::streamsize>(head))) return std::nullopt;
    for (std::uint64_t left = std::min<std::uint64_t>(number(0, head), 4096); left > 0; --left) {
        if (!file.read(bytes.data(), static_cast<std::streamsize>(entry))) return std::nullopt;
        if (number(0, 2) == tag) return static_cast<std::uint32_t>(number(entry == 20 ? 12 : 8, 2));
    }
    return std::nullopt;
}

TiffLayout tiff_layout(TIFF* tiff) {
    TiffLayout layout;
    layout.size = {static_cast<int>(std::min<std::uint32_t>(
                       tiff_field<std::uint32_t>(tiff, TIFFTAG_IMAGELENGTH).value_or(0), INT32_MAX)),
                   static_cast<int>(std::min<std::uint32_t>(
                       tiff_field<std::uint32_t>(tiff, TIFFTAG_IMAGEWIDTH).value_or(0), INT32_MAX))};
    layout.samples = tiff_word(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
    layout.bits = tiff_word(tiff, TIFFTAG_BITSPERSAMPLE, 1);
    layout.format = tiff_word(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
    if (layout.format == SAMPLEFORMAT_VOID) layout.format = SAMPLEFORMAT_UINT;
    layout.compression = tiff_word(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
    layout.planar = tiff_word(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    layout.photometric = tiff_field<std::uint16_t>(tiff, TIFFTAG_PHOTOMETRIC)
                             .value_or(layout.samples >= 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
    layout.orientation = tiff_word(tiff, TIFFTAG_ORIENTATION, 1);
    switch (layout.photometric) {
        case PHOTOMETRIC_SEPARATED:
            layout.colours = 4;
            break;
        case PHOTOMETRIC_RGB:
        case PHOTOMETRIC_YCBCR:
        case PHOTOMETRIC_CIELAB:
        case PHOTOMETRIC_ICCLAB:
        case PHOTOMETRIC_ITULAB:
        case PHOTOMETRIC_LOGLUV:
            layout.colours = 3;
            break;
        default:
            break;
    }
    layout.colours = std::min(layout.colours, layout.samples);
    std::uint16_t count = 0;
    const std::uint16_t* kinds = nullptr;
    layout.has_extra = TIFFGetField(tiff, TIFFTAG_EXTRASAMPLES, &count, &kinds) == 1 && count > 0;
    if (layout.has_extra) {
        layout.extra.assign(kinds, kinds + count);
        layout.colours = std::max(1, std::min(layout.colours, layout.samples - static_cast<int>(count)));
    }
    layout.extra.resize(static_cast<std::size_t>(layout.samples - layout.colours), EXTRASAMPLE_UNSPECIFIED);
    return layout;
}

std::vector<TiffDirectory> tiff_directories(TIFF* tiff) {
    constexpr int most = 4096;
    std::vector<TiffDirectory> result;
    std::vector<std::uint64_t> below;
    do {
        result.push_back(directory_of(tiff));
        std::uint16_t count = 0;
        const std::uint64_t* offsets = nullptr;
        if (TIFFGetField(tiff, TIFFTAG_SUBIFD, &count, &offsets) == 1)
            below.insert(below.end(), offsets, offsets + count);
    } while (static_cast<int>(result.size()) < most && TIFFReadDirectory(tiff) == 1);
    if (std::ranges::all_of(result, [](const TiffDirectory& d) { return d.part.reduced; })) {
        for (const std::uint64_t offset : below)
            if (TIFFSetSubDirectory(tiff, offset) == 1) result.push_back(directory_of(tiff));
    }
    return result;
}

void check_tiff_layout(const TiffLayout& layout, TIFF* tiff, std::uintmax_t file_bytes,
                       const std::string& asked) {
    const auto refuse = [&](const std::string& found, const char* remedy = convert_it) {
        throw InputError(asked, found, remedy);
    };
    if (layout.size.width < 1 || layout.size.height < 1 || layout.samples < 1)
        refuse("its header says " + compact_text_of(layout.size) + " pixels", use_a_complete_file);
    if (layout.bits == 64) refuse("it is a TIFF of 64-bit values", "convert it to 32-bit float");
    if (TIFFIsCODECConfigured(layout.compression) == 0) {
        const TIFFCodec* const codec = TIFFFindCODEC(layout.compression);
        refuse(
            "its compression, " +
            (codec != nullptr ? std::string(codec->name) : "number " + std::to_string(layout.compression)) +
            ", is not supported");
    }
    const bool known_format =
        (layout.is_float() && (layout.bits == 16 || layout.bits == 32)) ||
        (layout.is_signed() && (layout.bits == 8 || layout.bits == 16 || layout.bits == 32)) ||
        (layout.format == SAMPLEFORMAT_UINT &&
         ((layout.bits >= 1 && layout.bits <= 16) || layout.bits == 24 || layout.bits == 32));
    if (!known_format)
        refuse("values of " + std::to_string(layout.bits) + " bits of sample format " +
               std::to_string(layout.format) + " are not supported");
    if (tiff_field<std::uint32_t>(tiff, TIFFTAG_IMAGEDEPTH).value_or(1) > 1)
        refuse("it is a volume", "give a flat picture");
    switch (layout.photometric) {
        case 32803:
        case 34892:
            refuse("it is a camera's raw data, which is not supported",
                   "develop it with a raw converter first");
            break;
        case PHOTOMETRIC_ITULAB:
            refuse("colours as ITU L*a*b* are not supported");
            break;
        case PHOTOMETRIC_SEPARATED:
            if (tiff_word(tiff, TIFFTAG_INKSET, INKSET_CMYK) != INKSET_CMYK || layout.colours != 4)
                refuse("its inks are not cyan, magenta, yellow and black, which is not supported");
            break;
        case PHOTOMETRIC_YCBCR:
        case PHOTOMETRIC_CIELAB:
        case PHOTOMETRIC_ICCLAB:
        case PHOTOMETRIC_LOGLUV:
            if (lacks_lab(layout))
                refuse("colours as L*a*b* of " + std::to_string(layout.bits) + " bits, sample format " +
                       std::to_string(layout.format) + ", are not supported");
            if (layout.colours != 3)
                refuse("its colours, which take 3 samples, have " + std::to_string(layout.colours) +
                       ", which is not supported");
            break;
        case PHOTOMETRIC_PALETTE:
            if (layout.format != SAMPLEFORMAT_UINT || layout.bits > 16)
                refuse("a palette whose indices are no whole numbers of up to 16 bits is not supported");
            break;
        case PHOTOMETRIC_MINISWHITE:
            if (layout.is_signed()) refuse("signed values of which the least is white are not supported");
            break;
        default:
            break;
    }
    check_packing(layout.size, static_cast<double>(layout.size.width) * layout.samples * layout.bits / 8.0,
                  file_bytes, asked);
}

}  // namespace btfield::detail
