#pragma once

/// \file
/// What the picture formats are and what each can hold. No codec here.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "btfield/image_io.hpp"

namespace btfield::detail {

constexpr const char* use_a_complete_file = "give a complete and undamaged file";

constexpr const char* convert_it = "convert it with another program first";

/// Whether a codec's message says that it does not know the kind, as opposed to damage.
[[nodiscard]] bool says_unsupported(std::string_view message);

/// Of Picture::remarks.
constexpr const char* wide_integers_remark =
    "its 32-bit integers are beyond 16777216, from where on float32 drops their last digits";

/// Of Picture::remarks.
constexpr const char* associated_alpha_remark =
    "its colours are stored multiplied by alpha (associated alpha), and stay so";

/// The last two are read, not written.
enum class PictureFormat { png, jpeg, tiff, exr, hdr, pnm, webp, heif };

/// Stands in the description of a file whose format would suggest another colour space to the reader.
inline constexpr std::string_view space_mark = "btfield colour space: ";

/// The colour space that a description gives to three planes; nothing when it gives none.
[[nodiscard]] std::optional<ColourSpace> said_space(std::string_view description);

/// Those of all planes: by one word for all, or by one for each. Nothing when it gives none, or another
/// number of them.
[[nodiscard]] std::optional<std::vector<ColourSpace>> said_spaces(std::string_view description, int planes);

/// Stands before the names of planes in the description of a TIFF: their number, and one on each line.
inline constexpr std::string_view names_mark = "btfield planes: ";
/// The names as a description gives them; empty when it gives none.
[[nodiscard]] std::vector<std::string> said_names(std::string_view description);

/// OpenEXR's convention for CIE XYZ: the primaries are the axes, white is the equal-energy point.
inline constexpr std::array<float, 8> xyz_chromaticities{1, 0, 0, 1, 0, 0, 1.0F / 3.0F, 1.0F / 3.0F};

/// OpenImageIO's name of the format.
[[nodiscard]] std::string_view codec_name(PictureFormat format);

/// By the file's first bytes (at least 8 where the file has them); empty when they are of none.
[[nodiscard]] std::optional<PictureFormat> format_of_bytes(std::string_view head);

/// Format of a file, and its size.
/// \throws InputError when it is missing, no regular file, empty, unreadable or of no known format.
[[nodiscard]] PictureFormat checked_format(const std::filesystem::path& path, const std::string& asked,
                                           std::uintmax_t& bytes);

/// All of a file; empty where it cannot be opened.
[[nodiscard]] std::string file_content(const std::filesystem::path& path);

/// A damaged header must not claim all memory.
/// \param row_bytes  of the decoded picture
/// \param best_packing  bytes that one of the file can stand for; of any codec unless told (zstd runs: 32768)
/// \throws InputError when no codec could have packed so many pixels into the file.
void check_packing(Size size, double row_bytes, std::uintmax_t file_bytes, const std::string& asked,
                   double best_packing = 65536.0);

/// The whole picture when there is no crop.
/// \throws InputError when the crop is empty or leaves the picture.
[[nodiscard]] Crop checked_crop(const std::optional<Crop>& crop, Size size, const std::string& asked);

/// One of several pictures in a file.
struct Part {
    std::string name;      ///< empty: it has none
    std::string what;      ///< its size and kind, for messages
    bool reduced = false;  ///< a smaller copy, or a mask, of another
};

/// Number of the part that is wanted: by number or name, or the only one that is not reduced.
/// \throws InputError listing them when there are several and none is chosen, or there is none such
[[nodiscard]] int chosen_part(const std::vector<Part>& parts, const std::string& wanted,
                              const std::string& asked);

/// How a picture is going to be stored.
struct Storage {
    PictureFormat format = PictureFormat::png;
    PixelType type = PixelType::uint8;
    /// Primaries that the file is to name; of EXR and HDR.
    std::optional<Chromaticities> chromaticities = {};
    std::optional<int> compression = {};  ///< as in WriteOptions
};

/// Format by the extension (any case); none where it is unknown.
[[nodiscard]] std::optional<PictureFormat> format_of_name(const std::filesystem::path& path);

/// Format by the extension (any case), type by the rule of write_picture().
/// \throws InputError when the extension is unknown or the format cannot hold the planes or the type.
[[nodiscard]] Storage storage_for(const std::filesystem::path& path, int planes, PixelType source,
                                  std::optional<PixelType> type, const std::string& asked);

/// \throws InputError when a side is beyond what the format holds, or what its readers take
void check_sides(PictureFormat format, Size size, const std::string& asked);

}  // namespace btfield::detail
