#include "host/pictures/picture_description.hpp"

#include <algorithm>
#include <cstddef>

#include "host/pictures/channels.hpp"

namespace btfield::detail {
namespace {

std::vector<ColourSpace> spaces_of_planes(const Image& image) {
    std::vector<ColourSpace> spaces;
    spaces.reserve(static_cast<std::size_t>(image.planes()));
    for (int p = 0; p < image.planes(); ++p) spaces.push_back(image.plane_space(p));
    return spaces;
}

/// The space of each plane that a reader assumes when the file does not say.
/// \param channels  of the file
std::vector<ColourSpace> assumed_spaces(const Image& image, const Storage& storage,
                                        const std::vector<std::string>& channels) {
    constexpr std::size_t most_read_as_colours = 5;  // of samples without names, as has_colours() has it
    const bool integer = storage.type == PixelType::uint8 || storage.type == PixelType::uint16;
    const ColourSpace colour = integer ? ColourSpace::srgb : ColourSpace::linear;
    const auto count = static_cast<std::size_t>(image.planes());
    if (count == 3) return std::vector(count, colour);
    if (storage.format == PictureFormat::exr) return spaces_of_channels(channels);
    std::vector<ColourSpace> spaces(count, ColourSpace::unspecified);
    if (storage.format == PictureFormat::tiff && !image.names().empty()) {
        const std::vector<ColourSpace> said = spaces_of_channels(image.names());
        const std::size_t colours = count > 3 ? 3 : 1;
        if (std::all_of(said.begin(), said.begin() + static_cast<std::ptrdiff_t>(colours),
                        [](ColourSpace s) { return s == ColourSpace::linear; }))
            std::fill_n(spaces.begin(), colours, colour);
    } else if (count == 1 || storage.format == PictureFormat::tiff) {
        if (count != 2 && count <= most_read_as_colours)
            std::fill_n(spaces.begin(), count == 1 ? 1 : 3, colour);
    }
    return spaces;
}

}  // namespace

std::string description_of(const Image& image, const Storage& storage,
                           const std::vector<std::string>& channels) {
    std::string text;
    // Primaries of their own say what the values are.
    const bool said =
        image.planes() == 3 && storage.chromaticities && image.space() == ColourSpace::unspecified;
    const std::vector<ColourSpace> spaces = spaces_of_planes(image);
    // What whole numbers of many planes in a TIFF are, a reader can only guess.
    const bool guessed = storage.format == PictureFormat::tiff && image.names().empty() &&
                         spaces.size() != 3 && spaces.size() != 1;
    if (!said && (guessed || spaces != assumed_spaces(image, storage, channels))) {
        const bool alike = std::ranges::all_of(spaces, [&](ColourSpace s) { return s == spaces.front(); });
        text = std::string(space_mark) + std::string(name(spaces.front()));
        for (std::size_t p = 1; p < spaces.size() && !alike; ++p) text += " " + std::string(name(spaces[p]));
    }
    if (storage.format == PictureFormat::tiff && !image.names().empty()) {
        text += (text.empty() ? "" : "\n") + std::string(names_mark) + std::to_string(image.planes());
        for (const std::string& each : image.names()) {
            text += '\n';
            for (const char c : each) text += c == '\n' || c == '\0' ? ' ' : c;
        }
    }
    return text;
}

}  // namespace btfield::detail
