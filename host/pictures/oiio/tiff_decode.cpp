#include "host/pictures/oiio/tiff_decode.hpp"

#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/half.hpp"
#include "host/base/text.hpp"
#include "host/pictures/channels.hpp"
#include "host/pictures/colour.hpp"
#include "host/pictures/oiio/colour_profile.hpp"
#include "host/pictures/orientation.hpp"
#include "host/pictures/picture_format.hpp"

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

struct CloseTiff {
    void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
struct FreeOptions {
    void operator()(TIFFOpenOptions* options) const { TIFFOpenOptionsFree(options); }
};
using Tiff = std::unique_ptr<TIFF, CloseTiff>;

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

/// Tags of the chosen picture that say how to read it.
struct Layout {
    Size size;
    int samples = 1, bits = 1;
    std::uint16_t format = SAMPLEFORMAT_UINT, photometric = PHOTOMETRIC_MINISBLACK;
    std::uint16_t compression = COMPRESSION_NONE, planar = PLANARCONFIG_CONTIG;
    int colours = 1;                   ///< samples that are not extra
    std::vector<std::uint16_t> extra;  ///< kind of each extra sample
    bool has_extra = false;            ///< the file says so itself
    int orientation = 1;

    [[nodiscard]] bool is_float() const { return format == SAMPLEFORMAT_IEEEFP; }
    [[nodiscard]] bool is_signed() const { return format == SAMPLEFORMAT_INT; }
    /// Fractions of the largest value, as opposed to numbers with a unit.
    [[nodiscard]] bool is_fraction() const { return format == SAMPLEFORMAT_UINT && bits <= 16; }
    [[nodiscard]] double largest() const { return std::ldexp(1.0, bits) - 1.0; }
    [[nodiscard]] PixelType type() const {
        if (is_float()) return bits == 16 ? PixelType::half : PixelType::float32;
        if (!is_fraction()) return PixelType::float32;
        return bits <= 8 ? PixelType::uint8 : PixelType::uint16;
    }
};

template <class Value>
std::optional<Value> field(TIFF* tiff, std::uint32_t tag) {
    Value value{};
    if (TIFFGetField(tiff, tag, &value) != 1) return std::nullopt;
    return value;
}

std::uint16_t word_of(TIFF* tiff, std::uint32_t tag, std::uint16_t otherwise) {
    std::uint16_t value = 0;
    return TIFFGetFieldDefaulted(tiff, tag, &value) == 1 ? value : otherwise;
}

Layout layout_of(TIFF* tiff) {
    Layout layout;
    layout.size = {static_cast<int>(std::min<std::uint32_t>(
                       field<std::uint32_t>(tiff, TIFFTAG_IMAGELENGTH).value_or(0), INT32_MAX)),
                   static_cast<int>(std::min<std::uint32_t>(
                       field<std::uint32_t>(tiff, TIFFTAG_IMAGEWIDTH).value_or(0), INT32_MAX))};
    layout.samples = word_of(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
    layout.bits = word_of(tiff, TIFFTAG_BITSPERSAMPLE, 1);
    layout.format = word_of(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
    if (layout.format == SAMPLEFORMAT_VOID) layout.format = SAMPLEFORMAT_UINT;
    layout.compression = word_of(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
    layout.planar = word_of(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    layout.photometric = field<std::uint16_t>(tiff, TIFFTAG_PHOTOMETRIC)
                             .value_or(layout.samples >= 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
    layout.orientation = word_of(tiff, TIFFTAG_ORIENTATION, 1);
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

/// What stands in the file's list of pictures.
struct Directory {
    Part part;
    std::uint64_t offset = 0;
};

Directory directory_of(TIFF* tiff) {
    const Layout layout = layout_of(tiff);
    Directory result;
    result.offset = TIFFCurrentDirOffset(tiff);
    if (const auto name = field<const char*>(tiff, TIFFTAG_PAGENAME)) result.part.name = valid_utf8(*name);
    result.part.what = compact_text_of(layout.size) + ", " + std::to_string(layout.samples) +
                       (layout.samples == 1 ? " sample" : " samples");
    const std::uint32_t kind = field<std::uint32_t>(tiff, TIFFTAG_SUBFILETYPE).value_or(0);
    const std::uint16_t old_kind = field<std::uint16_t>(tiff, TIFFTAG_OSUBFILETYPE).value_or(0);
    result.part.reduced =
        (kind & (FILETYPE_REDUCEDIMAGE | FILETYPE_MASK)) != 0 || old_kind == OFILETYPE_REDUCEDIMAGE;
    return result;
}

/// All pictures; those in the tree below only where no other is a full one, as raw files have them.
std::vector<Directory> directories_of(TIFF* tiff) {
    constexpr int most = 4096;
    std::vector<Directory> result;
    std::vector<std::uint64_t> below;
    do {
        result.push_back(directory_of(tiff));
        std::uint16_t count = 0;
        const std::uint64_t* offsets = nullptr;
        if (TIFFGetField(tiff, TIFFTAG_SUBIFD, &count, &offsets) == 1)
            below.insert(below.end(), offsets, offsets + count);
    } while (static_cast<int>(result.size()) < most && TIFFReadDirectory(tiff) == 1);
    if (std::ranges::all_of(result, [](const Directory& d) { return d.part.reduced; })) {
        for (const std::uint64_t offset : below)
            if (TIFFSetSubDirectory(tiff, offset) == 1) result.push_back(directory_of(tiff));
    }
    return result;
}

/// L*a*b* of bits that its encoding does not have.
bool lacks_lab(const Layout& layout) {
    const bool lab = layout.photometric == PHOTOMETRIC_CIELAB || layout.photometric == PHOTOMETRIC_ICCLAB;
    const bool whole = layout.is_fraction() && (layout.bits == 8 || layout.bits == 16);
    return lab && !layout.is_float() && !whole;
}

/// Refuses, by name, what cannot be read.
void check_layout(const Layout& layout, TIFF* tiff, std::uintmax_t file_bytes, const std::string& asked) {
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
    if (field<std::uint32_t>(tiff, TIFFTAG_IMAGEDEPTH).value_or(1) > 1)
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
            if (word_of(tiff, TIFFTAG_INKSET, INKSET_CMYK) != INKSET_CMYK || layout.colours != 4)
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

/// 1 to 16 bits, packed from the highest on.
std::uint32_t packed_value(const std::uint8_t* bytes, std::size_t index, int bits) {
    std::uint32_t value = 0;
    std::size_t bit = index * static_cast<std::size_t>(bits);
    for (int i = 0; i < bits; ++i, ++bit) value = value << 1 | (bytes[bit / 8] >> (7 - bit % 8) & 1U);
    return value;
}

template <class Value>
Value native(const std::uint8_t* bytes, std::size_t index) {
    Value value{};
    std::memcpy(&value, bytes + index * sizeof(Value), sizeof(Value));
    return value;
}

/// A sample of a decoded row; unsigned integers up to 16 bits as fractions.
struct Sampler {
    const Layout& layout;
    bool beyond_float = false;  ///< a whole number that float32 rounds was met

    float operator()(const std::uint8_t* row, std::size_t i) {
        if (layout.is_float())
            return layout.bits == 16 ? float_of_half(native<std::uint16_t>(row, i)) : native<float>(row, i);
        if (layout.bits == 8 && !layout.is_signed()) return static_cast<float>(row[i]) / 255.0F;
        if (layout.bits == 16 && !layout.is_signed())
            return static_cast<float>(native<std::uint16_t>(row, i)) / 65535.0F;
        if (layout.bits < 16 && !layout.is_signed())
            return static_cast<float>(packed_value(row, i, layout.bits)) /
                   static_cast<float>(layout.largest());
        if (layout.bits == 8) return static_cast<float>(native<std::int8_t>(row, i));
        if (layout.bits == 16) return static_cast<float>(native<std::int16_t>(row, i));
        std::int64_t value = 0;
        if (layout.bits == 24)
            value = static_cast<std::int64_t>(row[3 * i]) | static_cast<std::int64_t>(row[3 * i + 1]) << 8 |
                    static_cast<std::int64_t>(row[3 * i + 2]) << 16;
        else if (layout.is_signed())
            value = native<std::int32_t>(row, i);
        else
            value = native<std::uint32_t>(row, i);
        if (layout.photometric == PHOTOMETRIC_MINISWHITE)
            value = static_cast<std::int64_t>(layout.largest()) - value;
        beyond_float = beyond_float || value > 16777216 || value < -16777216;
        return static_cast<float>(value);
    }
};

/// One file while its pixels are read.
class Pixels {
  public:
    Pixels(TIFF* tiff, const Layout& layout, const std::string& message, const std::string& asked)
        : tiff_(tiff), layout_(layout), message_(message), asked_(asked) {}

    /// All samples of the stored rectangle.
    Image samples(Crop crop, bool& beyond_float) {
        Image result({crop.height, crop.width}, layout_.samples);
        Sampler sampler{layout_};
        const int planes = layout_.planar == PLANARCONFIG_SEPARATE ? layout_.samples : 1;
        for (int plane = 0; plane < planes; ++plane) {
            if (TIFFIsTiled(tiff_) != 0)
                read_tiles(crop, plane, result, sampler);
            else
                read_strips(crop, plane, result, sampler);
        }
        beyond_float = sampler.beyond_float;
        return result;
    }

    /// As libtiff shows it, 8 bits: of kinds that only it can decode.
    Image shown(Crop crop) {
        std::array<char, 1024> why{};
        if (TIFFRGBAImageOK(tiff_, why.data()) == 0)
            throw InputError(asked_, "it is of a kind that is not supported (" + valid_utf8(why.data()) + ")",
                             convert_it);
        const Size size = layout_.size;
        std::vector<std::uint32_t> raster(area(size));
        if (TIFFReadRGBAImageOriented(tiff_, static_cast<std::uint32_t>(size.width),
                                      static_cast<std::uint32_t>(size.height), raster.data(),
                                      layout_.orientation, 1) == 0)
            refuse();
        Image result({crop.height, crop.width}, 3);
        for (int row = 0; row < crop.height; ++row)
            for (int column = 0; column < crop.width; ++column) {
                const std::uint32_t pixel =
                    raster[static_cast<std::size_t>(crop.y + row) * static_cast<std::size_t>(size.width) +
                           static_cast<std::size_t>(crop.x + column)];
                result.at(0, row, column) = static_cast<float>(TIFFGetR(pixel)) / 255.0F;
                result.at(1, row, column) = static_cast<float>(TIFFGetG(pixel)) / 255.0F;
                result.at(2, row, column) = static_cast<float>(TIFFGetB(pixel)) / 255.0F;
            }
        return result;
    }

  private:
    [[noreturn]] void refuse() const {
        if (says_unsupported(message_))
            throw InputError(asked_, "it is of a kind that is not supported (" + message_ + ")", convert_it);
        throw InputError(
            asked_, message_.empty() ? "its pixels cannot be decoded" : "its pixels are damaged: " + message_,
            use_a_complete_file);
    }

    /// Columns from `from` on of a decoded row that begins at column `begin`, to their place.
    void take(const std::uint8_t* row, int begin, int from, int to, int stored_row, Crop crop, int plane,
              Image& result, Sampler& sampler) const {
        const bool apart = layout_.planar == PLANARCONFIG_SEPARATE;
        const auto samples = static_cast<std::size_t>(apart ? 1 : layout_.samples);
        for (std::size_t s = 0; s < samples; ++s) {
            const int p = apart ? plane : static_cast<int>(s);
            for (int column = from; column < to; ++column)
                result.at(p, stored_row - crop.y, column - crop.x) =
                    sampler(row, static_cast<std::size_t>(column - begin) * samples + s);
        }
    }

    void read_strips(Crop crop, int plane, Image& result, Sampler& sampler) const {
        const auto row_bytes = static_cast<std::size_t>(TIFFScanlineSize(tiff_));
        const std::uint32_t given = word32(TIFFTAG_ROWSPERSTRIP);
        const int rows = static_cast<int>(std::min<std::uint32_t>(
            given == 0 ? UINT32_MAX : given, static_cast<std::uint32_t>(layout_.size.height)));
        std::vector<std::uint8_t> strip(row_bytes * static_cast<std::size_t>(rows));
        for (int y = crop.y - crop.y % rows; y < crop.y + crop.height; y += rows) {
            const int count = std::min(rows, layout_.size.height - y);
            const auto wanted = static_cast<tmsize_t>(row_bytes * static_cast<std::size_t>(count));
            const std::uint32_t number =
                TIFFComputeStrip(tiff_, static_cast<std::uint32_t>(y), static_cast<std::uint16_t>(plane));
            if (TIFFReadEncodedStrip(tiff_, number, strip.data(), wanted) != wanted) refuse();
            for (int row = std::max(y, crop.y); row < std::min(y + count, crop.y + crop.height); ++row)
                take(strip.data() + static_cast<std::size_t>(row - y) * row_bytes, 0, crop.x,
                     crop.x + crop.width, row, crop, plane, result, sampler);
        }
    }

    void read_tiles(Crop crop, int plane, Image& result, Sampler& sampler) const {
        const int width = static_cast<int>(word32(TIFFTAG_TILEWIDTH)),
                  height = static_cast<int>(word32(TIFFTAG_TILELENGTH));
        if (width < 1 || height < 1) refuse();
        const auto row_bytes = static_cast<std::size_t>(TIFFTileRowSize(tiff_));
        std::vector<std::uint8_t> tile(static_cast<std::size_t>(TIFFTileSize(tiff_)));
        for (int y = crop.y - crop.y % height; y < crop.y + crop.height; y += height) {
            for (int x = crop.x - crop.x % width; x < crop.x + crop.width; x += width) {
                const std::uint32_t number =
                    TIFFComputeTile(tiff_, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), 0,
                                    static_cast<std::uint16_t>(plane));
                const auto wanted = static_cast<tmsize_t>(tile.size());
                if (TIFFReadEncodedTile(tiff_, number, tile.data(), wanted) != wanted) refuse();
                for (int row = std::max(y, crop.y); row < std::min(y + height, crop.y + crop.height); ++row)
                    take(tile.data() + static_cast<std::size_t>(row - y) * row_bytes, x, std::max(x, crop.x),
                         std::min(x + width, crop.x + crop.width), row, crop, plane, result, sampler);
            }
        }
    }

    [[nodiscard]] std::uint32_t word32(std::uint32_t tag) const {
        std::uint32_t value = 0;
        return TIFFGetFieldDefaulted(tiff_, tag, &value) == 1 ? value : 0;
    }

    TIFF* tiff_;
    const Layout& layout_;
    const std::string& message_;
    const std::string& asked_;
};

/// Indices become colours.
Image looked_up(TIFF* tiff, const Image& indices, Layout& layout, const std::string& asked) {
    std::array<const std::uint16_t*, 3> maps{};
    if (TIFFGetField(tiff, TIFFTAG_COLORMAP, &maps[0], &maps[1], &maps[2]) != 1)
        throw InputError(asked, "it has no palette for its indices", use_a_complete_file);
    const auto count = static_cast<std::size_t>(layout.largest()) + 1;
    // Entries of 8 bits are stored twice over, shifted up, or, wrongly, as they are.
    bool twice = true, shifted = true, plain = true;
    for (const std::uint16_t* map : maps)
        for (std::size_t i = 0; i < count; ++i) {
            twice = twice && map[i] % 257 == 0;
            shifted = shifted && map[i] % 256 == 0;
            plain = plain && map[i] < 256;
        }
    const int down = twice ? 257 : shifted ? 256 : 1;
    const float top = twice || shifted || plain ? 255.0F : 65535.0F;
    Image result(indices.size(), 3);
    for (std::size_t i = 0; i < area(indices.size()); ++i) {
        const auto index = static_cast<std::size_t>(
            std::lround(static_cast<double>(indices.plane(0)[i]) * layout.largest()));
        for (int p = 0; p < 3; ++p) {
            const int value = maps[static_cast<std::size_t>(p)][index] / down;  // whole steps
            result.plane(p)[i] = static_cast<float>(value) / top;
        }
    }
    layout.bits = top == 255.0F ? 8 : 16;
    return result;
}

/// Values of a L*a*b* sample triple, as its encoding has them.
std::array<double, 3> lab_of(const Layout& layout, std::array<double, 3> stored) {
    if (!layout.is_fraction()) return stored;
    const bool wide = layout.bits == 16;
    const double top = layout.largest();
    if (layout.photometric == PHOTOMETRIC_ICCLAB) {
        const double scale = wide ? 65280.0 : 255.0;
        const auto centred = [&](double v) { return wide ? v * top / 256.0 - 128.0 : v * top - 128.0; };
        return {stored[0] * top * 100.0 / scale, centred(stored[1]), centred(stored[2])};
    }
    // a* and b* in two's complement.
    const auto about_zero = [&](double v) {
        const double whole = v * top;
        const double value = whole > top / 2.0 ? whole - top - 1.0 : whole;
        return wide ? value / 256.0 : value;
    };
    return {stored[0] * 100.0, about_zero(stored[1]), about_zero(stored[2])};
}

void convert_lab(TIFF* tiff, const Layout& layout, Picture& picture) {
    std::array<double, 2> white{0.34567, 0.35850};  // D50, as all who write it have it
    if (const auto given = field<const float*>(tiff, TIFFTAG_WHITEPOINT); given && (*given)[1] > 0.0F)
        white = {static_cast<double>((*given)[0]), static_cast<double>((*given)[1])};
    const std::array<double, 3> xyz_white{white[0] / white[1], 1.0, (1.0 - white[0] - white[1]) / white[1]};
    const auto back = [](double t) {
        constexpr double delta = 6.0 / 29.0;
        return t > delta ? t * t * t : 3.0 * delta * delta * (t - 4.0 / 29.0);
    };
    Image& image = picture.image;
    for (std::size_t i = 0; i < area(image.size()); ++i) {
        const std::array<double, 3> lab =
            lab_of(layout, {image.plane(0)[i], image.plane(1)[i], image.plane(2)[i]});
        const double y = (lab[0] + 16.0) / 116.0;
        image.plane(0)[i] = static_cast<float>(xyz_white[0] * back(y + lab[1] / 500.0));
        image.plane(1)[i] = static_cast<float>(back(y));
        image.plane(2)[i] = static_cast<float>(xyz_white[2] * back(y - lab[2] / 200.0));
    }
    transform(image, adaptation(white, {rec709[6], rec709[7]}));
    image.set_space(ColourSpace::xyz);
    const bool integer = layout.is_fraction();
    convert(image, integer ? ColourSpace::srgb : ColourSpace::linear);
    picture.remarks.push_back(std::string("its colours are CIE L*a*b*, and became ") +
                              (integer ? "sRGB" : "linear Rec. 709"));
}

constexpr std::uint32_t gdal_metadata_tag = 42112, gdal_nodata_tag = 42113;

/// Text of a tag that libtiff does not know.
std::optional<std::string> foreign_text(TIFF* tiff, std::uint32_t tag) {
    std::uint32_t count = 0;
    const char* text = nullptr;
    const TIFFField* const known = TIFFFindField(tiff, tag, TIFF_ASCII);
    if (known == nullptr || TIFFFieldPassCount(known) == 0) return std::nullopt;
    if (TIFFGetField(tiff, tag, &count, &text) != 1 || text == nullptr) return std::nullopt;
    const std::string_view all(text, count);
    return valid_utf8(all.substr(0, all.find('\0')));
}

bool has_tag(TIFF* tiff, std::uint32_t tag) {
    std::uint32_t count = 0;
    const void* values = nullptr;
    const TIFFField* const known = TIFFFindField(tiff, tag, TIFF_ANY);
    return known != nullptr && TIFFFieldPassCount(known) != 0 &&
           TIFFGetField(tiff, tag, &count, &values) == 1;
}

/// Whether the picture is a map of the earth: its values are measured.
bool is_map(TIFF* tiff) {
    constexpr std::array<std::uint32_t, 5> tags{33550, 33922, 34735, gdal_metadata_tag, gdal_nodata_tag};
    return std::ranges::any_of(tags, [&](std::uint32_t tag) { return has_tag(tiff, tag); });
}

/// Light by the file's TransferFunction: a table of all values for each colour, or for all of them.
void take_transfer(TIFF* tiff, const Layout& layout, ColourMeaning& meaning) {
    std::array<const std::uint16_t*, 3> tables{};
    if (!layout.is_fraction() ||
        TIFFGetField(tiff, TIFFTAG_TRANSFERFUNCTION, &tables[0], &tables[1], &tables[2]) != 1)
        return;
    const std::size_t count = std::size_t{1} << layout.bits;
    bool straight = true, screens = true;
    std::array<std::vector<double>, 3> curves;
    for (std::size_t p = 0; p < 3; ++p) {
        const std::uint16_t* const table = tables.at(p) != nullptr ? tables.at(p) : tables[0];
        std::vector<double>& curve = curves.at(p);
        for (std::size_t i = 0; i < count; ++i) {
            const double value = static_cast<double>(i) / static_cast<double>(count - 1);
            curve.push_back(table[i] / 65535.0);
            straight = straight && std::abs(curve.back() - value) < 2e-3;
            screens = screens && std::abs(srgb_encoded(curve.back()) - value) < 4e-3;
        }
        // White at 0 has been turned by then.
        if (layout.photometric == PHOTOMETRIC_MINISWHITE) std::ranges::reverse(curve);
    }
    if (screens) return;
    if (straight)
        meaning.exponent = 1.0;
    else
        meaning.curves = std::move(curves);
    meaning.said_by = "from what its TransferFunction says";
}

/// Black and white of a file's ReferenceBlackWhite, where they are not the ends of its range, to 0 and 1.
void apply_reference(TIFF* tiff, const Layout& layout, Picture& picture) {
    const auto given = field<const float*>(tiff, TIFFTAG_REFERENCEBLACKWHITE);
    if (!given || picture.image.planes() != 3) return;
    const std::span<const float> reference(*given, 6);
    const auto top = static_cast<float>(layout.largest());
    const bool chroma = layout.photometric == PHOTOMETRIC_YCBCR;
    const std::array<float, 6> usual{0.0F, top, chroma ? 128.0F : 0.0F, top, chroma ? 128.0F : 0.0F, top};
    if (std::ranges::equal(reference, usual, [](float a, float b) { return std::abs(a - b) < 0.5F; })) return;
    bool sound = layout.is_fraction() && !chroma;
    for (std::size_t p = 0; p < 3; ++p) sound = sound && reference[2 * p + 1] - reference[2 * p] > 0.5F;
    if (!sound) {
        picture.remarks.emplace_back("its ReferenceBlackWhite was ignored");
        return;
    }
    for (int p = 0; p < 3; ++p) {
        const float black = reference[2 * static_cast<std::size_t>(p)],
                    white = reference[2 * static_cast<std::size_t>(p) + 1];
        for (float& value : picture.image.plane(p)) value = (value * top - black) / (white - black);
    }
    picture.remarks.emplace_back("black and white were set to 0 and 1 by what its ReferenceBlackWhite says");
}

/// Pixels of which GDAL says that they hold nothing.
void tell_no_data(TIFF* tiff, const Layout& layout, const Image& samples, Picture& picture) {
    const std::optional<std::string> said = foreign_text(tiff, gdal_nodata_tag);
    if (!said) return;
    char* end = nullptr;
    const double value = std::strtod(said->c_str(), &end);
    if (end == said->c_str()) return;
    const auto stored = static_cast<float>(layout.is_fraction() ? value / layout.largest() : value);
    if (std::ranges::find(samples.values(), stored) != samples.values().end())
        picture.remarks.push_back("its pixels without data (GDAL_NODATA " + *said +
                                  ") are taken as values; crop them away");
}

ColourMeaning meaning_of(TIFF* tiff, const Layout& layout) {
    ColourMeaning meaning;
    if (layout.photometric != PHOTOMETRIC_PALETTE) take_transfer(tiff, layout, meaning);
    std::uint32_t bytes = 0;
    const void* profile = nullptr;
    if (TIFFGetField(tiff, TIFFTAG_ICCPROFILE, &bytes, &profile) == 1 && bytes > 0)
        meaning.profile.assign(static_cast<const char*>(profile), bytes);
    const auto primaries = field<const float*>(tiff, TIFFTAG_PRIMARYCHROMATICITIES);
    const auto white = field<const float*>(tiff, TIFFTAG_WHITEPOINT);
    if (layout.photometric == PHOTOMETRIC_RGB && primaries) {
        Chromaticities& given = meaning.primaries.emplace(rec709);
        std::copy_n(*primaries, 6, given.begin());
        if (white) std::copy_n(*white, 2, given.begin() + 6);
        meaning.said_by = meaning.said_by.empty()
                              ? "from what its PrimaryChromaticities say"
                              : "from what its PrimaryChromaticities and TransferFunction say";
    }
    return meaning;
}

std::vector<std::string> names_of_samples(const Layout& layout, const std::string& description) {
    std::vector<std::string> names = channel_names(layout.samples);
    if (layout.colours == 1) {
        names.assign(1, "Y");
        for (int s = 1; s < layout.samples; ++s) names.push_back("channel" + std::to_string(s));
    } else {
        for (int s = 3; s < layout.samples; ++s)
            names[static_cast<std::size_t>(s)] = "channel" + std::to_string(s);
        if (layout.photometric == PHOTOMETRIC_SEPARATED) {
            const std::array<const char*, 4> inks{"C", "M", "Y", "K"};
            std::copy(inks.begin(), inks.end(), names.begin());
        }
    }
    const std::vector<std::string> said = said_names(description);
    for (std::size_t s = 0; s < layout.extra.size(); ++s) {
        const bool alpha =
            layout.extra[s] == EXTRASAMPLE_ASSOCALPHA || layout.extra[s] == EXTRASAMPLE_UNASSALPHA;
        // Without a word about it, a fourth sample beside RGB is one.
        const bool assumed =
            !layout.has_extra && layout.extra.size() == 1 && layout.colours == 3 && said.empty();
        if (alpha || assumed) names[static_cast<std::size_t>(layout.colours) + s] = "A";
    }
    return said.size() == names.size() ? said : names;
}

/// What one plane of grey is before profile or primaries are looked at: numbers with a unit, and those of
/// maps, are no light.
ColourSpace grey_space(TIFF* tiff, const Layout& layout, const std::string& description) {
    if (const auto said = said_spaces(description, 1)) return said->front();
    const std::vector<std::string> names = said_names(description);
    if (!names.empty() && names.front() != "Y") return ColourSpace::unspecified;
    if (layout.is_fraction()) return ColourSpace::srgb;
    if (!layout.is_float() || is_map(tiff)) return ColourSpace::unspecified;
    return ColourSpace::linear;
}

/// Space that numbers have before profile or primaries are looked at.
ColourSpace plain_space(const Layout& layout, const std::string& description) {
    if (const auto said = said_space(description)) return *said;
    return layout.is_fraction() ? ColourSpace::srgb : ColourSpace::linear;
}

/// Colours of the samples that the photometric interpretation is about.
void interpret(TIFF* tiff, Layout& layout, const ReadOptions& options, Picture& picture,
               const std::string& asked) {
    Image& image = picture.image;
    const std::string description = field<const char*>(tiff, TIFFTAG_IMAGEDESCRIPTION).value_or("");
    const bool keeps_white = layout.photometric == PHOTOMETRIC_MINISWHITE && options.keep_values;
    if (image.planes() == 1 && !keeps_white) image.set_plane_spaces({grey_space(tiff, layout, description)});
    switch (layout.photometric) {
        case PHOTOMETRIC_MINISWHITE:
            if (options.keep_values || !(layout.is_fraction() || layout.is_float())) return;
            for (float& value : image.values()) value = 1.0F - value;
            if (layout.is_float())
                picture.remarks.emplace_back("its floats have white at 0, and became 1 - value");
            break;
        case PHOTOMETRIC_PALETTE:
            image = looked_up(tiff, image, layout, asked);
            picture.type = layout.type();
            image.set_space(ColourSpace::srgb);
            break;
        case PHOTOMETRIC_LOGL:
            image.set_space(ColourSpace::linear);
            return;
        case PHOTOMETRIC_LOGLUV:
            image.set_space(ColourSpace::xyz);
            return;
        case PHOTOMETRIC_CIELAB:
        case PHOTOMETRIC_ICCLAB:
            if (!options.keep_values) convert_lab(tiff, layout, picture);
            return;
        case PHOTOMETRIC_SEPARATED:
            break;
        default:
            if (image.planes() == 3) image.set_space(plain_space(layout, description));
            if (const auto said = said_spaces(description, image.planes()); image.planes() == 3 && said)
                if (image.space() == ColourSpace::unspecified) image.set_plane_spaces(*said);
    }
    if (!said_space(description)) {
        const bool rgb = layout.photometric == PHOTOMETRIC_RGB || layout.photometric == PHOTOMETRIC_YCBCR;
        if (rgb && !options.keep_values) apply_reference(tiff, layout, picture);
        const ColourMeaning meaning = meaning_of(tiff, layout);
        apply_meaning(picture, meaning, options.keep_values);
        const auto white = field<const float*>(tiff, TIFFTAG_WHITEPOINT);
        const bool alone = rgb && white && meaning.profile.empty() && !meaning.primaries;
        if (alone && !(std::abs((*white)[0] - 0.3127F) < 4e-3F && std::abs((*white)[1] - 0.3290F) < 4e-3F))
            picture.remarks.emplace_back(
                "its WhitePoint stands without PrimaryChromaticities, and was ignored");
    }
    if (layout.photometric == PHOTOMETRIC_SEPARATED && image.planes() == 4)
        convert_cmyk(picture, options.keep_values);
}

/// Settings of codecs that hand out what other kinds of pictures have.
void prepare(TIFF* tiff, const Layout& layout) {
    if (layout.photometric == PHOTOMETRIC_YCBCR && layout.compression == COMPRESSION_JPEG)
        TIFFSetField(tiff, TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
    if (layout.photometric == PHOTOMETRIC_LOGL || layout.photometric == PHOTOMETRIC_LOGLUV)
        TIFFSetField(tiff, TIFFTAG_SGILOGDATAFMT, SGILOGDATAFMT_FLOAT);
}

/// Whether three samples are colours beside others, as far as names of planes do not tell otherwise. Writers
/// call stacks of many bands RGB too: those are colours where the file describes them.
bool has_colours(TIFF* tiff, const Layout& layout, const std::string& description) {
    if (layout.colours != 3 ||
        (layout.photometric != PHOTOMETRIC_RGB && layout.photometric != PHOTOMETRIC_YCBCR))
        return false;
    if (const auto said = said_spaces(description, layout.samples))
        return said->front() != ColourSpace::unspecified;
    const std::vector<std::string> names = said_names(description);
    if (static_cast<int>(names.size()) == layout.samples) {
        const std::vector<ColourSpace> spaces = spaces_of_channels(names);
        return std::all_of(spaces.begin(), spaces.begin() + 3,
                           [](ColourSpace s) { return s == ColourSpace::linear; });
    }
    constexpr int most_beside = 2;
    const ColourMeaning meaning = meaning_of(tiff, layout);
    return layout.samples <= 3 + most_beside || !meaning.profile.empty() || meaning.primaries ||
           !meaning.curves.front().empty();
}

/// Converts the colours as a whole, whichever of them are among the planes.
void take_colours(TIFF* tiff, Layout& layout, const ReadOptions& options, Image colours,
                  const ChannelPlan& plan, Picture& picture, const std::string& asked) {
    Picture own;
    own.type = picture.type;
    own.image = std::move(colours);
    interpret(tiff, layout, options, own, asked);
    std::vector<ColourSpace> spaces(static_cast<std::size_t>(layout.samples), ColourSpace::unspecified);
    for (int c = 0; c < layout.colours; ++c) spaces[static_cast<std::size_t>(c)] = own.image.plane_space(c);
    for (std::size_t p = 0; p < plan.planes.size(); ++p)
        if (const int c = plan.planes[p]; c < layout.colours)
            std::ranges::copy(own.image.plane(c), picture.image.plane(static_cast<int>(p)).begin());
    picture.image.set_plane_spaces(spaces_of(spaces, plan.planes));
    picture.remarks.insert(picture.remarks.end(), own.remarks.begin(), own.remarks.end());
}

/// Colours as one picture; extra samples stand beside them where they are wanted.
Picture read_samples(TIFF* tiff, Layout& layout, const ReadOptions& options, Crop stored, Pixels& pixels,
                     const std::string& asked) {
    Picture picture;
    picture.type = layout.type();
    const std::string description = field<const char*>(tiff, TIFFTAG_IMAGEDESCRIPTION).value_or("");
    const std::vector<std::string> names = names_of_samples(layout, description);
    const ChannelPlan plan = plan_channels(names, options.planes, -1, asked);
    bool beyond_float = false;
    Image all = pixels.samples(stored, beyond_float);
    if (beyond_float) picture.remarks.emplace_back(wide_integers_remark);
    tell_no_data(tiff, layout, all, picture);

    std::vector<int> colours(static_cast<std::size_t>(layout.colours));
    for (int s = 0; s < layout.colours; ++s) colours[static_cast<std::size_t>(s)] = s;
    const auto taken = [&](const std::vector<int>& channels) {
        Image image(all.size(), static_cast<int>(channels.size()));
        for (std::size_t p = 0; p < channels.size(); ++p)
            std::ranges::copy(all.plane(channels[p]), image.plane(static_cast<int>(p)).begin());
        return image;
    };
    picture.image = taken(plan.planes);
    // Colours as a whole, alone or apart from other planes.
    const bool whole = plan.planes == colours;
    if (whole) interpret(tiff, layout, options, picture, asked);
    if (!whole &&
        (layout.photometric == PHOTOMETRIC_PALETTE || layout.photometric == PHOTOMETRIC_SEPARATED ||
         layout.photometric == PHOTOMETRIC_CIELAB || layout.photometric == PHOTOMETRIC_ICCLAB) &&
        !options.keep_values && std::ranges::any_of(plan.planes, [&](int c) { return c < layout.colours; }))
        throw InputError(asked,
                         "its colours have to be converted, and are not read apart or beside other planes",
                         "choose all of them with --planes, or give --keep-values");
    if (!whole && has_colours(tiff, layout, description))
        take_colours(tiff, layout, options, taken(colours), plan, picture, asked);
    if (const auto said = said_spaces(description, picture.image.planes()); !whole && said)
        picture.image.set_plane_spaces(*said);
    if (!whole && layout.photometric == PHOTOMETRIC_MINISWHITE && !options.keep_values)
        for (std::size_t p = 0; p < plan.planes.size(); ++p)
            if (plan.planes[p] == 0 && (layout.is_fraction() || layout.is_float()))
                for (float& value : picture.image.plane(static_cast<int>(p))) value = 1.0F - value;
    for (const int channel : plan.alpha) {
        const auto given = all.plane(channel);
        if (picture.alpha.empty())
            picture.alpha.assign(given.begin(), given.end());
        else
            for (std::size_t i = 0; i < given.size(); ++i)
                picture.alpha[i] = std::min(picture.alpha[i], given[i]);
    }
    const bool multiplied = std::ranges::any_of(plan.alpha, [&](int channel) {
        return channel >= layout.colours &&
               layout.extra[static_cast<std::size_t>(channel - layout.colours)] == EXTRASAMPLE_ASSOCALPHA;
    });
    if (multiplied && std::ranges::any_of(picture.alpha, [](float a) { return a != 1.0F; }))
        picture.remarks.emplace_back(associated_alpha_remark);
    if (!said_names(description).empty() && picture.image.planes() == static_cast<int>(plan.names.size()))
        picture.image.set_names(plan.names);
    return picture;
}

/// A word of the list of tags at `offset`, as the file has it: libtiff takes palettes without colours for
/// grey. Nothing where there is none.
std::optional<std::uint32_t> stored_word(const std::filesystem::path& path, std::uint64_t offset,
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

constexpr const char* no_palette =
    "it has a palette's indices and no palette (ColorMap), which is not supported";

/// What libtiff says when it cannot take a file's header.
[[noreturn]] void refuse_header(const std::string& message, const std::string& asked) {
    if (message.find("Colormap") != std::string::npos) throw InputError(asked, no_palette, convert_it);
    if (says_unsupported(message))
        throw InputError(asked, "it is of a kind that is not supported (" + message + ")", convert_it);
    throw InputError(asked, message.empty() ? "its header is damaged" : "its header is damaged: " + message,
                     use_a_complete_file);
}

}  // namespace

Picture decode_tiff(const std::filesystem::path& path, const ReadOptions& options, std::uintmax_t file_bytes,
                    const std::string& asked) {
    std::string message;
    const Tiff tiff = open_tiff(path, message);
    if (!tiff) refuse_header(message, asked);
    const std::vector<Directory> directories = directories_of(tiff.get());
    std::vector<Part> parts;
    parts.reserve(directories.size());
    for (const Directory& each : directories) parts.push_back(each.part);
    const int number = chosen_part(parts, options.part, asked);
    message.clear();
    const std::uint64_t offset = directories[static_cast<std::size_t>(number)].offset;
    if (TIFFSetSubDirectory(tiff.get(), offset) != 1) refuse_header(message, asked);
    Layout layout = layout_of(tiff.get());
    check_layout(layout, tiff.get(), file_bytes, asked);
    if (layout.photometric != PHOTOMETRIC_PALETTE &&
        stored_word(path, offset, TIFFTAG_PHOTOMETRIC) == PHOTOMETRIC_PALETTE)
        throw InputError(asked, no_palette, convert_it);
    prepare(tiff.get(), layout);
    const bool shown = layout.compression == COMPRESSION_OJPEG ||
                       (layout.photometric == PHOTOMETRIC_YCBCR && layout.compression != COMPRESSION_JPEG);
    layout = layout_of(tiff.get());
    const Orientation orientation(layout.orientation);
    const Crop crop = checked_crop(options.crop, orientation.upright(layout.size), asked);
    const Crop stored = orientation.stored(crop, layout.size);
    Pixels pixels(tiff.get(), layout, message, asked);
    try {
        Picture picture;
        if (shown) {
            picture.image = pixels.shown(stored);
            picture.image.set_space(ColourSpace::srgb);
            apply_meaning(picture, meaning_of(tiff.get(), layout), options.keep_values);
            keep_planes(picture, plan_channels(channel_names(3), options.planes, -1, asked));
        } else {
            picture = read_samples(tiff.get(), layout, options, stored, pixels, asked);
        }
        make_upright(picture, orientation);
        return picture;
    } catch (const std::bad_alloc&) {
        throw InputError(asked,
                         compact_text_of(crop) + " pixels of " + std::to_string(layout.samples) +
                             " samples do not fit in memory",
                         "crop the picture");
    }
}

}  // namespace btfield::detail
