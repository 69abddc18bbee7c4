#pragma once

/// \file
/// Reading and writing pictures (PNG, JPEG, TIFF, EXR, Radiance HDR, PNM) of any number of planes, and
/// reading WebP and HEIC.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/image.hpp"

namespace btfield {

/// Storage type of one plane value in a file.
enum class PixelType { uint8, uint16, half, float32 };

/// "uint8", "uint16", "half", "float".
[[nodiscard]] BTFIELD_API std::string_view name(PixelType type);
/// Inverse of name().
/// \throws InputError for any other text
[[nodiscard]] BTFIELD_API PixelType pixel_type(std::string_view name);
/// Bytes of one value.
[[nodiscard]] BTFIELD_API int bytes_per_value(PixelType type);

/// Rectangle in pixels, as `--crop X,Y,W,H` gives it.
struct Crop {
    int x = 0, y = 0, width = 0, height = 0;
};

/// CIE x, y of red, green, blue and white, as OpenEXR orders them.
using Chromaticities = std::array<double, 8>;

/// A picture with what its file said about it.
struct Picture {
    Image image;               ///< colour or data planes only
    std::vector<float> alpha;  ///< H × W, empty when the file has none; separated, never modelled. Of several
                               ///< layers' the least
    PixelType type = PixelType::uint8;
    std::uintmax_t file_bytes = 0;
    /// Primaries of a file whose colours were converted to Rec. 709, or, with keep_values, those that its
    /// values have.
    std::optional<Chromaticities> chromaticities;
    /// What the values are not as the file has them, and what of it was left out: one sentence each, without
    /// capital and full stop. Empty for most pictures.
    std::vector<std::string> remarks;
};

/// What to read of a file, and how.
struct ReadOptions {
    std::optional<Crop> crop;  ///< of the upright picture
    /// Which of several pictures in the file: its number from 0, or its name. Empty: the only one that is no
    /// reduced copy.
    std::string part;
    /// Planes by name ("550nm", "diffuse.R"), layer ("diffuse": all of its planes but alpha) or number from
    /// 0, in this order. Empty: all but alpha.
    std::vector<std::string> planes;
    /// Numbers as the file has them: colours are not converted. Types are scaled all the same.
    bool keep_values = false;
};

/// Reads a picture, upright. 8-bit and 16-bit values become [0, 1], others keep their unit. Colours that a
/// file describes (ICC profile, chromaticities, gamma, photometric interpretation) are converted to sRGB
/// (integers) or linear Rec. 709 (floats), without clamping; XYZ stays XYZ. One or two planes, or more than
/// three, are unspecified unless the file says that one plane is linear light. See docs/pictures.md.
/// \throws InputError when the file is missing, empty, truncated, damaged, of no known format, of a kind that
///     is not supported, holds several pictures of equal rank and `part` chooses none, lacks a part or plane
///     that is asked for, holds NaN or infinite values inside the crop, or the crop leaves the picture
[[nodiscard]] BTFIELD_API Picture read_picture(const std::filesystem::path& path, const ReadOptions& options);
/// The whole of it, or a crop.
[[nodiscard]] BTFIELD_API Picture read_picture(const std::filesystem::path& path,
                                               std::optional<Crop> crop = {});

/// Whether values of a plane reach the ends of [0, 1], or lie beyond.
struct PlaneLimits {
    bool low = false, high = false;
    friend bool operator==(const PlaneLimits&, const PlaneLimits&) = default;
};
/// Of each plane of the picture.
[[nodiscard]] BTFIELD_API std::vector<PlaneLimits> plane_limits(const Image& image);

/// What happened to values on the way to the file.
struct WriteReport {
    /// Pixels with at least one value outside [0, 1]; in an HDR file, which holds no sign, below 0; else 0.
    /// Of the values as they are stored, without those at limits that WriteOptions::limits has.
    std::uintmax_t clamped_pixels = 0;
    /// Conversions that may surprise and losses, as Picture::remarks.
    std::vector<std::string> remarks;
};

/// How a picture is written.
struct WriteOptions {
    PixelType source = PixelType::uint8;  ///< storage of the picture that this one comes from
    /// Without one, by extension and source: EXR half for 8 bit and half, else float; HDR float; TIFF as the
    /// source; the others uint8, or uint16 where the source has more than 8 bits and the format can (PNG,
    /// PNM).
    std::optional<PixelType> type;
    /// Stores the numbers as they are, whatever the format takes them for. What PNG, TIFF and EXR can, they
    /// say of the colour space.
    bool keep_values = false;
    /// Linear colours in EXR and HDR are stored in these primaries, and the file says so.
    std::optional<Chromaticities> chromaticities;
    /// Of the picture that this one comes from: where its own planes were cut off, that of the texture is no
    /// loss to count. Empty, or one per plane.
    std::vector<PlaneLimits> limits = {};
    /// Effort of lossless compression in PNG, TIFF and EXR, from 0, none, to 9. Without one 1 in PNG, and
    /// what the codecs take for the others.
    std::optional<int> compression = {};
};

/// Writes all planes. Unless values are kept, colours become what the file's readers take them for: sRGB in
/// files of whole numbers, linear Rec. 709 in those of floats, XYZ in EXR alone; what is unspecified stays.
/// Names of planes become channel names in EXR, and stand in the description of a TIFF. The file appears
/// complete under its name (written beside it, then renamed) or not at all.
/// \throws InputError when the extension is unknown, the format cannot hold the planes, the type or the size,
///     a value is NaN or infinite, or the file cannot be written
BTFIELD_API WriteReport write_picture(const std::filesystem::path& path, const Image& image,
                                      const WriteOptions& options);
/// With these options alone.
BTFIELD_API WriteReport write_picture(const std::filesystem::path& path, const Image& image,
                                      PixelType source = PixelType::uint8,
                                      std::optional<PixelType> type = {});

/// \throws what write_picture would throw for this name and shape, before any work is done: unknown
///     extension, impossible planes, type or size, folder missing or unwritable
BTFIELD_API void check_writable(const std::filesystem::path& path, int planes, PixelType source,
                                std::optional<PixelType> type = {}, std::optional<Size> size = {});

/// Begins, in the background, what the first picture needs once in a process that is read from other than
/// PNM, Radiance, PNG and JPEG or written to other than the first three: loading the codecs, a third of a
/// second of processor time. Returns at once; a picture that is read or written meanwhile waits for the rest,
/// and so does the end of the process. Any number of calls from any threads do it once. A failure is reported
/// by the read_picture() or write_picture() that needs the codecs. Does nothing where btfield is a static
/// library: the codecs are part of the program then.
BTFIELD_API void preload_picture_formats();
enum class PictureUse { write, read };
/// The same where using a file of such a name so needs the codecs; else nothing.
BTFIELD_API void preload_picture_formats(const std::filesystem::path& path,
                                         PictureUse use = PictureUse::write);

}  // namespace btfield
