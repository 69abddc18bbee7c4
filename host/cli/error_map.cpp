#include "host/cli/error_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>

#include "btfield/error.hpp"
#include "host/cli/output_names.hpp"
#include "host/pictures/picture_names.hpp"

namespace btfield::cli {
namespace {

using Colour = std::array<float, 3>;

/// Of rising lightness, so that the map can be read in grey as well; sRGB.
constexpr std::array<Colour, 6> ramp{{{0.00F, 0.00F, 0.02F},
                                      {0.26F, 0.04F, 0.41F},
                                      {0.58F, 0.15F, 0.40F},
                                      {0.87F, 0.32F, 0.23F},
                                      {0.99F, 0.65F, 0.04F},
                                      {0.99F, 1.00F, 0.64F}}};
constexpr Colour not_there{1.0F, 0.0F, 1.0F};

bool holds_values(const std::filesystem::path& path) {
    const std::string extension = lower_extension(path);
    return extension == ".exr" || extension == ".tif" || extension == ".tiff";
}

Colour false_colour(float error, float largest) {
    if (error < 0.0F) return not_there;
    constexpr auto last = static_cast<float>(ramp.size() - 1);
    const float at = largest > 0.0F ? error / largest * last : 0.0F;
    const float step = std::clamp(std::floor(at), 0.0F, last - 1.0F);
    const Colour& from = ramp[static_cast<std::size_t>(step)];
    const Colour& to = ramp[static_cast<std::size_t>(step) + 1];
    Colour result{};
    for (std::size_t i = 0; i < 3; ++i) result[i] = from[i] + (to[i] - from[i]) * (at - step);
    return result;
}

}  // namespace

void check_error_map(const std::filesystem::path& path, std::optional<PixelType> type,
                     std::optional<Size> size) {
    if (!holds_values(path)) {
        check_writable(path, 3, PixelType::uint8, type.value_or(PixelType::uint8), size);
        return;
    }
    const PixelType stored = type.value_or(PixelType::float32);
    if (stored != PixelType::float32 && stored != PixelType::half)
        throw InputError(
            "write the map '" + path.string() + "' as " + std::string(name(stored)),
            "errors are from 0 to 255 and more, with -1 for none; whole numbers are shares of white",
            "use --type half or float, or a PNG in false colours");
    check_writable(path, 1, PixelType::float32, stored, size);
}

void write_error_map(const std::filesystem::path& path, Size size, std::span<const float> errors,
                     std::optional<PixelType> type) {
    if (holds_values(path)) {
        Image values(size, 1);
        std::copy(errors.begin(), errors.end(), values.values().begin());
        write_picture(path, values, PixelType::float32, type.value_or(PixelType::float32));
        return;
    }
    const float largest = *std::max_element(errors.begin(), errors.end());
    Image colours(size, 3, ColourSpace::srgb);
    for (std::size_t pixel = 0; pixel < errors.size(); ++pixel) {
        const Colour colour = false_colour(errors[pixel], largest);
        for (int p = 0; p < 3; ++p) colours.plane(p)[pixel] = colour[static_cast<std::size_t>(p)];
    }
    write_picture(path, colours, PixelType::uint8, type.value_or(PixelType::uint8));
}

}  // namespace btfield::cli
