// Control fields as pictures, of control_field.hpp.

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <utility>

#include "btfield/control_field.hpp"
#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/base/file_output.hpp"
#include "host/base/text.hpp"
#include "host/pictures/palette_png.hpp"
#include "host/pictures/picture_format.hpp"
#include "host/pictures/pnm.hpp"

namespace btfield {

using namespace detail;

namespace {

std::string colour_text(const PaletteColour& colour) {
    return std::to_string(colour[0]) + "," + std::to_string(colour[1]) + "," + std::to_string(colour[2]);
}

/// "column 3, row 2" of pixel i.
std::string place_of(std::size_t i, Size size) {
    const auto width = static_cast<std::size_t>(size.width);
    return "column " + std::to_string(i % width) + ", row " + std::to_string(i / width);
}

[[noreturn]] void refuse_transparency(std::size_t i, Size size, const std::string& asked) {
    throw InputError(asked, "the pixel at " + place_of(i, size) + " is transparent",
                     "give a picture without alpha, in which every pixel has a region");
}

void check_label(int value, std::size_t i, const ControlField& field, const std::string& asked) {
    if (value < field.regions) return;
    throw InputError(asked, "the value at " + place_of(i, field.size) + " is " + std::to_string(value),
                     field.regions == 1 ? "use the value 0 alone"
                                        : "use the values 0 to " + std::to_string(field.regions - 1));
}

ControlField labels_by_index(PaletteImage&& picture, int regions, const std::string& asked) {
    ControlField field{picture.size, regions, std::move(picture.values)};
    for (std::size_t i = 0; i < field.labels.size(); ++i) {
        const std::uint8_t value = field.labels[i];
        check_label(value, i, field, asked);
        if (value >= picture.colours) {
            throw InputError(asked,
                             "the value at " + place_of(i, field.size) + " is " + std::to_string(value) +
                                 ", beyond the " + counted(picture.colours, "colour") + " of its own palette",
                             use_a_complete_file);
        }
        if (picture.alpha[value] != 255) refuse_transparency(i, field.size, asked);
    }
    return field;
}

/// \param top  the value that is 1 in the picture
ControlField labels_by_value(const Image& image, int top, int regions, const std::string& asked) {
    ControlField field{image.size(), regions, std::vector<std::uint8_t>(area(image.size()))};
    const auto values = image.plane(0);
    for (std::size_t i = 0; i < values.size(); ++i) {
        const auto value = static_cast<int>(std::lrint(values[i] * static_cast<float>(top)));
        check_label(value, i, field, asked);
        field.labels[i] = static_cast<std::uint8_t>(value);
    }
    return field;
}

int colour_distance(const PaletteColour& a, const PaletteColour& b) {
    int sum = 0;
    for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
    return sum;
}

ControlField labels_by_colour(const Image& image, std::span<const PaletteColour> palette,
                              const std::string& asked) {
    ControlField field{image.size(), static_cast<int>(palette.size()),
                       std::vector<std::uint8_t>(area(image.size()))};
    std::size_t label = 0;
    for (std::size_t i = 0; i < field.labels.size(); ++i) {
        PaletteColour colour;
        for (int p = 0; p < 3; ++p) {
            colour[static_cast<std::size_t>(p)] =
                static_cast<std::uint8_t>(std::lrint(image.plane(p)[i] * 255.0F));
        }
        if (i == 0 || colour != palette[label]) {
            const auto nearest =
                std::min_element(palette.begin(), palette.end(), [&](const auto& a, const auto& b) {
                    return colour_distance(a, colour) < colour_distance(b, colour);
                });
            label = static_cast<std::size_t>(nearest - palette.begin());
        }
        if (colour != palette[label]) {
            throw InputError(
                asked,
                "the colour at " + place_of(i, field.size) + ", " + colour_text(colour) +
                    ", is not in the palette",
                "paint with the palette's colours, which are others once regions were edited, and "
                "hard edges; the nearest is " +
                    colour_text(palette[label]) + ", of region " + std::to_string(label));
        }
        field.labels[i] = static_cast<std::uint8_t>(label);
    }
    return field;
}

ControlField labels_of(const Picture& picture, int top, std::span<const PaletteColour> palette,
                       const std::string& asked) {
    const Image& image = picture.image;
    if (picture.type != PixelType::uint8 || (image.planes() != 1 && image.planes() != 3)) {
        throw InputError(
            asked,
            "it has " + counted(image.planes(), "plane") + " of type " + std::string(name(picture.type)),
            "give a picture of 8 bits with a palette, in grey or in colour");
    }
    const auto clear =
        std::find_if(picture.alpha.begin(), picture.alpha.end(), [](float a) { return a != 1.0F; });
    if (clear != picture.alpha.end()) {
        refuse_transparency(static_cast<std::size_t>(clear - picture.alpha.begin()), image.size(), asked);
    }
    return image.planes() == 3 ? labels_by_colour(image, palette, asked)
                               : labels_by_value(image, top, static_cast<int>(palette.size()), asked);
}

}  // namespace

void write_labels(const std::filesystem::path& path, const ControlField& field,
                  std::span<const PaletteColour> palette) {
    const std::string asked = "write '" + path.string() + "'";
    check(field);
    std::string extension = path.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (extension != ".png") {
        throw InputError(asked,
                         extension.empty() ? "the name has no extension"
                                           : "labels cannot be stored as '" + extension + "'",
                         "end the name in .png");
    }
    const auto regions = static_cast<std::size_t>(field.regions);
    if (palette.size() < regions) {
        throw InputError(asked,
                         counted(palette.size(), "colour") + " are given for " + counted(regions, "region"),
                         "give a colour for each region");
    }
    write_file(path, encode_palette_png(field.size, field.labels, palette.first(regions), asked), asked);
}

ControlField read_labels(const std::filesystem::path& path, std::span<const PaletteColour> palette) {
    const std::string asked = "read '" + path.string() + "'";
    if (palette.empty() || palette.size() > most_regions) {
        throw InputError(asked, "the palette has " + counted(palette.size(), "colour"),
                         "give 1 to " + std::to_string(most_regions));
    }
    std::uintmax_t bytes = 0;
    const PictureFormat format = checked_format(path, asked, bytes);
    if (format == PictureFormat::png) {
        auto picture = decode_palette_png(path, asked);
        if (picture) return labels_by_index(*std::move(picture), static_cast<int>(palette.size()), asked);
    }
    const int top = format == PictureFormat::pnm ? pnm_maximum(path, asked) : 255;
    return labels_of(read_picture(path), top, palette, asked);
}

}  // namespace btfield
