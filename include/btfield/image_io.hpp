#pragma once

/// \file
/// Reading and writing pictures (PNG, JPEG, TIFF, EXR, Radiance HDR, PNM) of any number of planes.

#include <cstdint>
#include <filesystem>
#include <optional>
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

/// A picture with what its file said about it.
struct Picture {
    Image image;               ///< colour or data planes only, in file order
    std::vector<float> alpha;  ///< H × W, empty when the file has none; separated, never modelled
    PixelType type = PixelType::uint8;
    std::uintmax_t file_bytes = 0;
};

/// Reads a picture. 8-bit and 16-bit values become [0, 1], others stay. EXR whose chromaticities are those of
/// XYZ (or that says so) is ColourSpace::xyz; one or two planes, or more than three, are unspecified.
/// \throws InputError when the file is missing, empty, truncated, of no known format, holds NaN or infinite
///     values inside the crop, or the crop leaves the picture
[[nodiscard]] BTFIELD_API Picture read_picture(const std::filesystem::path& path,
                                               std::optional<Crop> crop = {});

/// What happened to values on the way to the file.
struct WriteReport {
    /// Pixels with at least one value outside [0, 1]; in an HDR file, which holds no sign, below 0; else 0.
    std::uintmax_t clamped_pixels = 0;
};

/// Writes all planes. The type follows `type`; without one, the extension: EXR half, HDR float, TIFF the
/// `source` type, the others uint8, or uint16 where `source` has more than 8 bits and the format can (PNG,
/// PNM). The file appears complete under its name (written beside it, then renamed) or not at all.
/// \throws InputError when the extension is unknown, the format cannot hold the planes or the type, a value
///     is NaN or infinite, or the file cannot be written
BTFIELD_API WriteReport write_picture(const std::filesystem::path& path, const Image& image,
                                      PixelType source = PixelType::uint8,
                                      std::optional<PixelType> type = {});

/// \throws what write_picture would throw for this name and shape, before any work is done: unknown
///     extension, impossible planes or type, folder missing or unwritable
BTFIELD_API void check_writable(const std::filesystem::path& path, int planes, PixelType source,
                                std::optional<PixelType> type = {});

/// Begins, in the background, what the first picture of any format but PNM needs once in a process: loading
/// the codecs, a third of a second of processor time. Returns at once; a picture that is read or written
/// meanwhile waits for the rest, and so does the end of the process. Any number of calls from any threads do
/// it once. A failure is reported by the read_picture() or write_picture() that needs the codecs. Does
/// nothing where btfield is a static library: the codecs are part of the program then.
BTFIELD_API void preload_picture_formats();

}  // namespace btfield
