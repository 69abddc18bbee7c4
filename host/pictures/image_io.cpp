#include "btfield/image_io.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/file_output.hpp"
#include "host/base/text.hpp"
#include "host/pictures/colour.hpp"
#include "host/pictures/encoded_picture.hpp"
#include "host/pictures/jpeg_decode.hpp"
#include "host/pictures/picture_codec.hpp"
#include "host/pictures/picture_format.hpp"
#include "host/pictures/png_decode.hpp"
#include "host/pictures/pnm.hpp"
#include "host/pictures/radiance.hpp"
#include "host/pictures/stored_picture.hpp"

namespace btfield {

using namespace detail;

namespace {

namespace fs = std::filesystem;

/// \param place  where the values lie in the file, for the message
void check_finite(std::span<const float> values, Crop place, const std::string& which,
                  const std::string& asked, const char* remedy) {
    const auto bad = std::find_if_not(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
    if (bad == values.end()) return;
    const auto at = bad - values.begin();
    throw InputError(asked,
                     which + " is " + (std::isnan(*bad) ? "NaN" : "infinite") + " at column " +
                         std::to_string(place.x + at % place.width) + ", row " +
                         std::to_string(place.y + at / place.width),
                     remedy);
}

/// Largest magnitude that the type can store, when rounding is taken into account.
double largest(const Storage& storage) {
    if (storage.type == PixelType::half) return 65519.0;      // from 65520 on half rounds to infinity
    if (storage.format == PictureFormat::hdr) return 1.7e38;  // shared exponent, 127 at most
    return std::numeric_limits<float>::max();
}

void check_values(const Image& image, const Storage& storage, const std::string& asked) {
    const double limit = largest(storage);
    for (int p = 0; p < image.planes(); ++p) {
        check_finite(image.plane(p), {0, 0, image.width(), image.height()}, "plane " + std::to_string(p),
                     asked, "give finite values");
        for (const float v : image.plane(p)) {
            if (!(std::abs(static_cast<double>(v)) <= limit)) {
                throw InputError(asked,
                                 "plane " + std::to_string(p) + " has the value " + std::to_string(v) +
                                     ", too large for the file's type",
                                 "write EXR or TIFF of type float");
            }
        }
    }
}

/// Pixels with a value that the file must clamp, where the picture that it comes from had none at that limit.
std::uintmax_t count_clamped(const Image& image, const Storage& storage,
                             const std::vector<PlaneLimits>& limits) {
    const bool integer = storage.type == PixelType::uint8 || storage.type == PixelType::uint16;
    if (!integer && storage.format != PictureFormat::hdr) return 0;
    constexpr float most = std::numeric_limits<float>::max();
    std::uintmax_t count = 0;
    std::vector<char> outside(static_cast<std::size_t>(image.width()));
    for (int row = 0; row < image.height(); ++row) {
        std::fill(outside.begin(), outside.end(), char{0});
        for (int p = 0; p < image.planes(); ++p) {
            const float* values = &image.plane(p)[static_cast<std::size_t>(row) * outside.size()];
            const PlaneLimits own = limits.empty() ? PlaneLimits{} : limits[static_cast<std::size_t>(p)];
            const float low = own.low ? -most : 0.0F, high = integer && !own.high ? 1.0F : most;
            for (std::size_t x = 0; x < outside.size(); ++x) {
                outside[x] =
                    static_cast<char>(outside[x] | static_cast<char>(values[x] < low || values[x] > high));
            }
        }
        count += static_cast<std::uintmax_t>(std::count(outside.begin(), outside.end(), char{1}));
    }
    return count;
}

bool is_integer(PixelType type) {
    return type == PixelType::uint8 || type == PixelType::uint16;
}

/// The value as a file of halves keeps it; it must be in range.
float half_rounded(float value) {
    const int exponent = value == 0.0F ? -14 : std::max(std::ilogb(value), -14);
    const double step = std::ldexp(1.0, exponent - 10);
    return static_cast<float>(std::nearbyint(static_cast<double>(value) / step) * step);
}

/// Bits that tell values apart, as far as types can be compared.
int precision(PixelType type) {
    switch (type) {
        case PixelType::uint8:
            return 8;
        case PixelType::half:
            return 11;
        case PixelType::uint16:
            return 16;
        case PixelType::float32:
            break;
    }
    return 24;
}

/// What one row of a plane is off by in the file, clamped values aside.
double squared_error(const Image& image, int p, const Storage& storage) {
    double sum = 0.0;
    const auto plane = image.plane(p);
    for (std::size_t i = 0; i < plane.size(); ++i) {
        const float value = plane[i];
        float kept = value;
        if (storage.format == PictureFormat::hdr) {
            float largest = 1e-32F;
            for (int q = 0; q < image.planes(); ++q) largest = std::max(largest, image.plane(q)[i]);
            const double step = std::ldexp(1.0, std::ilogb(largest) - 7);
            kept = value < 0.0F ? value : static_cast<float>(std::nearbyint(value / step) * step);
        } else if (storage.type == PixelType::half) {
            kept = half_rounded(value);
        } else if (is_integer(storage.type) && value >= 0.0F && value <= 1.0F) {
            const float top = storage.type == PixelType::uint8 ? 255.0F : 65535.0F;
            kept = std::nearbyint(value * top) / top;
        }
        const double off = static_cast<double>(kept) - static_cast<double>(value);
        sum += off * off;
    }
    return sum;
}

/// Tells where rounding to the file's type takes more of a plane than 5 % of its deviation.
void tell_loss(const Image& image, PixelType source, const Storage& storage,
               std::vector<std::string>& remarks) {
    const bool hdr = storage.format == PictureFormat::hdr;
    if (!hdr && precision(storage.type) >= precision(source)) return;
    for (int p = 0; p < image.planes(); ++p) {
        const auto plane = image.plane(p);
        const auto count = static_cast<double>(plane.size());
        double mean = 0.0, variance = 0.0;
        for (const float value : plane) mean += static_cast<double>(value) / count;
        for (const float value : plane) {
            const double off = static_cast<double>(value) - mean;
            variance += off * off / count;
        }
        const double error = squared_error(image, p, storage) / count;
        if (!(error > 0.05 * 0.05 * variance) || variance == 0.0) continue;
        remarks.push_back(
            "plane " + std::to_string(p) + " loses detail: " +
            (hdr ? "the format's shared exponent" : "type " + std::string(name(storage.type))) +
            " rounds it by more than 5 % of its deviation, and type float in EXR or TIFF keeps it");
        return;
    }
}

/// Tells of a plane that had values beyond the file's range in its picture too, which count as no clamping,
/// and of which so many are cut off that it looks another.
void tell_cut(const Image& image, const WriteOptions& options, const Storage& storage,
              std::vector<std::string>& remarks) {
    constexpr double most = 0.05;
    if (!is_integer(storage.type) || is_integer(options.source) || options.limits.empty()) return;
    for (int p = 0; p < image.planes(); ++p) {
        const PlaneLimits own = options.limits[static_cast<std::size_t>(p)];
        const auto plane = image.plane(p);
        const auto cut = std::ranges::count_if(
            plane, [&](float v) { return (own.low && v < 0.0F) || (own.high && v > 1.0F); });
        const double share = static_cast<double>(cut) / static_cast<double>(plane.size());
        if (!(share > most)) continue;
        remarks.push_back(std::to_string(std::lround(100.0 * share)) + " % of plane " + std::to_string(p) +
                          " lie outside of [0, 1], as in the picture, and are cut off; EXR and TIFF of type "
                          "float keep them");
        return;
    }
}

/// Of three planes with names of their own, which no word in such a file keeps from being taken for colours.
void tell_taken_for_colours(const Image& image, const Storage& storage, std::vector<std::string>& remarks) {
    const bool named = storage.format == PictureFormat::tiff || storage.format == PictureFormat::exr;
    if (named || image.planes() != 3 || image.names().empty()) return;
    for (int p = 0; p < image.planes(); ++p)
        if (image.plane_space(p) != ColourSpace::unspecified) return;
    remarks.push_back("its planes '" + image.names()[0] + "', '" + image.names()[1] + "' and '" +
                      image.names()[2] +
                      "' are no colours, but programs take those of such a file for red, green and blue (" +
                      (storage.format == PictureFormat::hdr ? "linear light" : "sRGB") +
                      "), and their names are lost; EXR and TIFF keep them");
}

std::string plane_list(const std::vector<int>& planes) {
    std::string text;
    for (std::size_t i = 0; i < planes.size(); ++i)
        text += (i == 0 ? "" : i + 1 == planes.size() ? " and " : ", ") + std::to_string(planes[i]);
    return text;
}

/// Grey, and colours among planes of several kinds.
void make_planes_readable(Image& image, const Storage& storage, WriteReport& report) {
    const bool integer = is_integer(storage.type);
    const ColourSpace to = integer ? ColourSpace::srgb : ColourSpace::linear;
    std::vector<ColourSpace> before = image.plane_spaces();
    std::vector<int> changed;
    for (std::size_t p = 0; p < before.size(); ++p) {
        const bool stays = before[p] == ColourSpace::unspecified || before[p] == to ||
                           (before[p] == ColourSpace::xyz && storage.format == PictureFormat::exr);
        if (!stays) changed.push_back(static_cast<int>(p));
    }
    if (changed.empty()) return;
    Image converted = image;
    convert_planes(converted, to);
    for (const int p : changed) {
        std::ranges::copy(converted.plane(p), image.plane(p).begin());
        before[static_cast<std::size_t>(p)] = to;
    }
    image.set_plane_spaces(before);
    const std::string how =
        integer ? "encoded as sRGB, as such files have it" : "made linear light, as such files have it";
    report.remarks.push_back(image.planes() == 1
                                 ? "its grey was " + how +
                                       "; maps such as heights need --keep-values (WriteOptions::keep_values)"
                                 : "the colours in planes " + plane_list(changed) + " were " + how +
                                       "; other planes are as they were");
}

/// Values as the format's readers take them.
void make_readable(Image& image, const Storage& storage, const WriteOptions& options, WriteReport& report) {
    if (image.space() == ColourSpace::unspecified) return make_planes_readable(image, storage, report);
    const ColourSpace from = image.space();
    if (from == ColourSpace::xyz && image.planes() != 3) return;
    ColourSpace to = is_integer(storage.type) ? ColourSpace::srgb : ColourSpace::linear;
    if (from == ColourSpace::xyz && storage.format == PictureFormat::exr) to = ColourSpace::xyz;
    if (from == ColourSpace::xyz && to != from) {
        report.remarks.push_back(std::string("XYZ is written as ") +
                                 (to == ColourSpace::srgb ? "sRGB" : "linear Rec. 709") + "; EXR keeps XYZ");
    }
    convert(image, to);
    const bool own = to == ColourSpace::linear && image.planes() == 3 && options.chromaticities &&
                     (storage.format == PictureFormat::exr || storage.format == PictureFormat::hdr);
    if (own) {
        const std::optional<Matrix3> matrix = rec709_from(*options.chromaticities);
        if (matrix) transform(image, inverse(*matrix).value());
    }
}

Picture decode(const fs::path& path, PictureFormat format, const ReadOptions& options, std::uintmax_t bytes,
               const std::string& asked) {
    switch (format) {
        case PictureFormat::pnm:
            return read_pnm(path, options, asked);
        case PictureFormat::hdr:
            return read_radiance(path, options, bytes, asked);
        case PictureFormat::png:
            return decode_png(path, options, asked);
        case PictureFormat::jpeg:
            return decode_jpeg(path, options, bytes, asked);
        default:
            return picture_codec(asked).decode(path, format, options, bytes, asked);
    }
}

}  // namespace

Picture read_picture(const fs::path& path, const ReadOptions& options) {
    const std::string asked = "read '" + path.string() + "'";
    std::uintmax_t bytes = 0;
    const PictureFormat format = checked_format(path, asked, bytes);
    Picture picture = decode(path, format, options, bytes, asked);
    picture.file_bytes = bytes;
    constexpr const char* repair = "repair those pixels or crop them away";
    const Crop place{options.crop ? options.crop->x : 0, options.crop ? options.crop->y : 0,
                     picture.image.width(), picture.image.height()};
    for (int p = 0; p < picture.image.planes(); ++p) {
        check_finite(picture.image.plane(p), place, "plane " + std::to_string(p), asked, repair);
    }
    check_finite(picture.alpha, place, "alpha", asked, repair);
    return picture;
}

std::vector<PlaneLimits> plane_limits(const Image& image) {
    std::vector<PlaneLimits> limits;
    for (int p = 0; p < image.planes(); ++p) {
        const std::span<const float> plane = image.plane(p);
        const auto [low, high] = std::minmax_element(plane.begin(), plane.end());
        limits.push_back({*low <= 0.0F, *high >= 1.0F});
    }
    return limits;
}

Picture read_picture(const fs::path& path, std::optional<Crop> crop) {
    return read_picture(path, ReadOptions{crop, {}, {}, false});
}

EncodedPicture detail::encode(const fs::path& path, const Image& image, const WriteOptions& options) {
    const std::string asked = "write '" + path.string() + "'";
    Storage storage = storage_for(path, image.planes(), options.source, options.type, asked);
    if (!options.limits.empty() && options.limits.size() != static_cast<std::size_t>(image.planes()))
        throw InputError(asked,
                         "limits of " + counted(options.limits.size(), "plane") + " are given for " +
                             std::to_string(image.planes()),
                         "give one of each, or none");
    check_sides(storage.format, image.size(), asked);
    EncodedPicture encoded;
    WriteReport& report = encoded.report;
    std::optional<Image> readable;
    const bool right = (image.space() == ColourSpace::unspecified && image.plane_spaces().empty()) ||
                       (image.space() == ColourSpace::srgb && is_integer(storage.type));
    if (!options.keep_values && !right) {
        check_values(image, {PictureFormat::tiff, PixelType::float32}, asked);
        make_readable(readable.emplace(image), storage, options, report);
    }
    const Image& stored = readable ? *readable : image;
    const bool own = stored.space() == ColourSpace::linear || stored.space() == ColourSpace::unspecified;
    if (stored.planes() == 3 && own) storage.chromaticities = options.chromaticities;
    check_values(stored, storage, asked);
    storage.compression = options.compression;
    encoded.file = std::make_unique<FileOutput>(path, asked);
    store_picture(encoded.file->temporary(), stored, storage, asked);
    report.clamped_pixels = count_clamped(stored, storage, options.limits);
    tell_loss(stored, options.source, storage, report.remarks);
    tell_cut(stored, options, storage, report.remarks);
    tell_taken_for_colours(stored, storage, report.remarks);
    return encoded;
}

WriteReport write_picture(const fs::path& path, const Image& image, const WriteOptions& options) {
    EncodedPicture encoded = encode(path, image, options);
    encoded.file->commit();
    return std::move(encoded.report);
}

WriteReport write_picture(const fs::path& path, const Image& image, PixelType source,
                          std::optional<PixelType> type) {
    return write_picture(path, image, WriteOptions{source, type, false, {}, {}});
}

void preload_picture_formats(const fs::path& path, PictureUse use) {
    switch (format_of_name(path).value_or(PictureFormat::pnm)) {
        case PictureFormat::pnm:
        case PictureFormat::hdr:
        case PictureFormat::png:
            return;
        case PictureFormat::jpeg:
            if (use == PictureUse::read) return;
            break;
        default:
            break;
    }
    preload_picture_formats();
}

void check_writable(const fs::path& path, int planes, PixelType source, std::optional<PixelType> type,
                    std::optional<Size> size) {
    const std::string asked = "write '" + path.string() + "'";
    const Storage storage = storage_for(path, planes, source, type, asked);
    if (size) check_sides(storage.format, *size, asked);
    check_output(path, asked);
}

}  // namespace btfield
