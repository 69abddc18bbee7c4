#include "host/pictures/oiio/tiff_pixels.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/half.hpp"
#include "host/base/text.hpp"

namespace btfield::detail {
namespace {

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

}  // namespace

/// A sample of a decoded row; unsigned integers up to 16 bits as fractions.
struct TiffPixels::Sampler {
    const TiffLayout& layout;
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

Image TiffPixels::samples(Crop crop, bool& beyond_float) const {
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

Image TiffPixels::shown(Crop crop) const {
    std::array<char, 1024> why{};
    if (TIFFRGBAImageOK(tiff_, why.data()) == 0)
        throw InputError(asked_, "it is of a kind that is not supported (" + valid_utf8(why.data()) + ")",
                         convert_it);
    const Size size = layout_.size;
    std::vector<std::uint32_t> raster(area(size));
    if (TIFFReadRGBAImageOriented(tiff_, static_cast<std::uint32_t>(size.width),
                                  static_cast<std::uint32_t>(size.height), raster.data(), layout_.orientation,
                                  1) == 0)
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

void TiffPixels::refuse() const {
    if (says_unsupported(message_))
        throw InputError(asked_, "it is of a kind that is not supported (" + message_ + ")", convert_it);
    throw InputError(
        asked_, message_.empty() ? "its pixels cannot be decoded" : "its pixels are damaged: " + message_,
        use_a_complete_file);
}

/// Columns from `from` on of a decoded row that begins at column `begin`, to their place.
void TiffPixels::take(const std::uint8_t* row, int begin, int from, int to, int stored_row, Crop crop,
                      int plane, Image& result, Sampler& sampler) const {
    const bool apart = layout_.planar == PLANARCONFIG_SEPARATE;
    const auto samples = static_cast<std::size_t>(apart ? 1 : layout_.samples);
    for (std::size_t s = 0; s < samples; ++s) {
        const int p = apart ? plane : static_cast<int>(s);
        for (int column = from; column < to; ++column)
            result.at(p, stored_row - crop.y, column - crop.x) =
                sampler(row, static_cast<std::size_t>(column - begin) * samples + s);
    }
}

void TiffPixels::read_strips(Crop crop, int plane, Image& result, Sampler& sampler) const {
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
            take(strip.data() + static_cast<std::size_t>(row - y) * row_bytes, 0, crop.x, crop.x + crop.width,
                 row, crop, plane, result, sampler);
    }
}

void TiffPixels::read_tiles(Crop crop, int plane, Image& result, Sampler& sampler) const {
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

std::uint32_t TiffPixels::word32(std::uint32_t tag) const {
    std::uint32_t value = 0;
    return TIFFGetFieldDefaulted(tiff_, tag, &value) == 1 ? value : 0;
}

}  // namespace btfield::detail
