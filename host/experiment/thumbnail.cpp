#include "host/experiment/thumbnail.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <string_view>

#include "btfield/error.hpp"

namespace btfield::detail {
namespace {

namespace fs = std::filesystem;

/// IEC 61966-2-1.
float srgb_encoded(float linear) {
    const float v = std::clamp(linear, 0.0F, 1.0F);
    return v <= 0.0031308F ? 12.92F * v : 1.055F * std::pow(v, 1.0F / 2.4F) - 0.055F;
}

/// XYZ (D65) to linear Rec. 709.
constexpr std::array<std::array<float, 3>, 3> rgb_of_xyz{{{3.2404542F, -1.5371385F, -0.4985314F},
                                                          {-0.9692660F, 1.8760108F, 0.0415560F},
                                                          {0.0556434F, -0.2040259F, 1.0572252F}}};

/// Three planes or one, as a screen shows them.
Image displayed(const Image& image, double white) {
    const bool colour = image.planes() >= 3;
    const bool light = image.plane_space(0) == ColourSpace::linear || image.space() == ColourSpace::xyz;
    Image shown(image.size(), colour ? 3 : 1, colour ? ColourSpace::srgb : ColourSpace::unspecified);
    const auto scale = static_cast<float>(1.0 / white);
    for (std::size_t i = 0; i < area(image.size()); ++i) {
        std::array<float, 3> value{};
        for (int p = 0; p < shown.planes(); ++p)
            value[static_cast<std::size_t>(p)] = scale * image.plane(p)[i];
        if (image.space() == ColourSpace::xyz && colour) {
            const std::array<float, 3> xyz = value;
            for (std::size_t p = 0; p < 3; ++p) {
                value[p] = rgb_of_xyz[p][0] * xyz[0] + rgb_of_xyz[p][1] * xyz[1] + rgb_of_xyz[p][2] * xyz[2];
            }
        }
        for (int p = 0; p < shown.planes(); ++p) {
            const float v = value[static_cast<std::size_t>(p)];
            shown.plane(p)[i] = light ? srgb_encoded(v) : std::clamp(v, 0.0F, 1.0F);
        }
    }
    return shown;
}

/// The PNG of a picture; its file is gone afterwards.
std::string png_bytes(const Image& image) {
    const fs::path file =
        fs::temp_directory_path() / ("btfield-thumbnail-" + std::to_string(::getpid()) + ".png");
    write_picture(file, image);
    std::ifstream stream(file, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    std::error_code ignored;
    fs::remove(file, ignored);
    return bytes;
}

}  // namespace

std::string base64(std::string_view bytes) {
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        unsigned word = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            word = word << 8U | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
        }
        for (std::size_t k = 0; k < 4; ++k) {
            const bool padding = i + k > bytes.size();
            text += padding ? '=' : digits[word >> (18 - 6 * k) & 63U];
        }
    }
    return text;
}

std::string thumbnail_uri(const fs::path& picture, const std::optional<Crop>& crop, double white, int side) {
    try {
        return thumbnail_uri(read_picture(picture, crop).image, white, side);
    } catch (const InputError&) {
        return {};
    }
}

std::string thumbnail_uri(const Image& image, double white, int side) {
    const Size size{std::min(side, image.height()), std::min(side, image.width())};
    return "data:image/png;base64," + base64(png_bytes(displayed(image.crop(0, 0, size), white)));
}

}  // namespace btfield::detail
