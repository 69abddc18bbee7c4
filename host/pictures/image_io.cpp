#include "btfield/image_io.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>

#include "btfield/error.hpp"
#include "host/base/file_output.hpp"
#include "host/pictures/picture_codec.hpp"
#include "host/pictures/picture_format.hpp"
#include "host/pictures/pnm.hpp"

namespace btfield {

using namespace detail;

namespace {

namespace fs = std::filesystem;

/// \param place  where the values lie in the file, for the message
void check_finite(std::span<const float> values, Crop place, const std::string& which,
                  const std::string& asked) {
    const auto bad = std::find_if_not(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
    if (bad == values.end()) return;
    const auto at = bad - values.begin();
    throw InputError(asked,
                     which + " is " + (std::isnan(*bad) ? "NaN" : "infinite") + " at column " +
                         std::to_string(place.x + at % place.width) + ", row " +
                         std::to_string(place.y + at / place.width),
                     "repair those pixels or crop them away");
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
                     asked);
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

/// Pixels with a value that the file must clamp.
std::uintmax_t count_clamped(const Image& image, const Storage& storage) {
    const bool integer = storage.type == PixelType::uint8 || storage.type == PixelType::uint16;
    if (!integer && storage.format != PictureFormat::hdr) return 0;
    const float high = integer ? 1.0F : std::numeric_limits<float>::max();
    std::uintmax_t count = 0;
    std::vector<char> outside(static_cast<std::size_t>(image.width()));
    for (int row = 0; row < image.height(); ++row) {
        std::fill(outside.begin(), outside.end(), char{0});
        for (int p = 0; p < image.planes(); ++p) {
            const float* values = &image.plane(p)[static_cast<std::size_t>(row) * outside.size()];
            for (std::size_t x = 0; x < outside.size(); ++x) {
                outside[x] =
                    static_cast<char>(outside[x] | static_cast<char>(values[x] < 0.0F || values[x] > high));
            }
        }
        count += static_cast<std::uintmax_t>(std::count(outside.begin(), outside.end(), char{1}));
    }
    return count;
}

}  // namespace

Picture read_picture(const fs::path& path, std::optional<Crop> crop) {
    const std::string asked = "read '" + path.string() + "'";
    std::uintmax_t bytes = 0;
    const PictureFormat format = checked_format(path, asked, bytes);
    Picture picture = format == PictureFormat::pnm
                          ? read_pnm(path, crop, asked)
                          : picture_codec(asked).decode(path, format, crop, bytes, asked);
    picture.file_bytes = bytes;
    const Crop place{crop ? crop->x : 0, crop ? crop->y : 0, picture.image.width(), picture.image.height()};
    for (int p = 0; p < picture.image.planes(); ++p) {
        check_finite(picture.image.plane(p), place, "plane " + std::to_string(p), asked);
    }
    check_finite(picture.alpha, place, "alpha", asked);
    return picture;
}

WriteReport write_picture(const fs::path& path, const Image& image, PixelType source,
                          std::optional<PixelType> type) {
    const std::string asked = "write '" + path.string() + "'";
    const Storage storage = storage_for(path, image.planes(), source, type, asked);
    check_values(image, storage, asked);
    FileOutput file(path, asked);
    if (storage.format == PictureFormat::pnm) {
        write_pnm(file.temporary(), image, storage.type, asked);
    } else {
        picture_codec(asked).encode(file.temporary(), image, storage, asked);
    }
    file.commit();
    return {count_clamped(image, storage)};
}

void check_writable(const fs::path& path, int planes, PixelType source, std::optional<PixelType> type) {
    const std::string asked = "write '" + path.string() + "'";
    static_cast<void>(storage_for(path, planes, source, type, asked));
    check_output(path, asked);
}

}  // namespace btfield
