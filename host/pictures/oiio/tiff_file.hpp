#pragma once

// A TIFF through libtiff: its pictures, and the tags that say how to read one.

#include <tiffio.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "btfield/image_io.hpp"
#include "host/pictures/picture_format.hpp"

namespace btfield::detail {

struct CloseTiff {
    void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
using Tiff = std::unique_ptr<TIFF, CloseTiff>;

/// Nothing when libtiff cannot take the header; `message` says why, then and later.
/// \param message  is to outlive what is returned
[[nodiscard]] Tiff open_tiff(const std::filesystem::path& path, std::string& message);

/// Tags of the chosen picture that say how to read it.
struct TiffLayout {
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

/// What stands in the file's list of pictures.
struct TiffDirectory {
    Part part;
    std::uint64_t offset = 0;
};

/// Value of a tag that the file has.
template <class Value>
std::optional<Value> tiff_field(TIFF* tiff, std::uint32_t tag) {
    Value value{};
    if (TIFFGetField(tiff, tag, &value) != 1) return std::nullopt;
    return value;
}

/// The same, or what libtiff takes where the file lacks it.
[[nodiscard]] std::uint16_t tiff_word(TIFF* tiff, std::uint32_t tag, std::uint16_t otherwise);
/// Text of a tag that libtiff does not know.
[[nodiscard]] std::optional<std::string> tiff_text(TIFF* tiff, std::uint32_t tag);
[[nodiscard]] bool has_tiff_tag(TIFF* tiff, std::uint32_t tag);
/// A word of the list of tags at `offset`, as the file has it: libtiff takes palettes without colours for
/// grey. Nothing where there is none.
[[nodiscard]] std::optional<std::uint32_t> stored_tiff_word(const std::filesystem::path& path,
                                                            std::uint64_t offset, std::uint16_t tag);

[[nodiscard]] TiffLayout tiff_layout(TIFF* tiff);
/// All pictures; those in the tree below only where no other is a full one, as raw files have them.
[[nodiscard]] std::vector<TiffDirectory> tiff_directories(TIFF* tiff);
/// Refuses, by name, what cannot be read.
/// \throws InputError
void check_tiff_layout(const TiffLayout& layout, TIFF* tiff, std::uintmax_t file_bytes,
                       const std::string& asked);

}  // namespace btfield::detail
