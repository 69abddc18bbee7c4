#include "host/pictures/oiio/tiff_decode.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <optional>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/pictures/channels.hpp"
#include "host/pictures/oiio/tiff_colours.hpp"
#include "host/pictures/oiio/tiff_file.hpp"
#include "host/pictures/oiio/tiff_pixels.hpp"
#include "host/pictures/orientation.hpp"

namespace btfield::detail {
namespace {

/// TiffPixels of which GDAL says that they hold nothing.
void tell_no_data(TIFF* tiff, const TiffLayout& layout, const Image& samples, Picture& picture) {
    const std::optional<std::string> said = tiff_text(tiff, gdal_nodata_tag);
    if (!said) return;
    char* end = nullptr;
    const double value = std::strtod(said->c_str(), &end);
    if (end == said->c_str()) return;
    const auto stored = static_cast<float>(layout.is_fraction() ? value / layout.largest() : value);
    if (std::ranges::find(samples.values(), stored) != samples.values().end())
        picture.remarks.push_back("its pixels without data (GDAL_NODATA " + *said +
                                  ") are taken as values; crop them away");
}

std::vector<std::string> names_of_samples(const TiffLayout& layout, const std::string& description) {
    std::vector<std::string> names = channel_names(layout.samples);
    if (layout.colours == 1) {
        names.assign(1, "Y");
        for (int s = 1; s < layout.samples; ++s) names.push_back("channel" + std::to_string(s));
    } else {
        for (int s = 3; s < layout.samples; ++s)
            names[static_cast<std::size_t>(s)] = "channel" + std::to_string(s);
        if (layout.photometric == PHOTOMETRIC_SEPARATED) {
            const std::array<const char*, 4> inks{"C", "M", "Y", "K"};
            std::copy(inks.begin(), inks.end(), names.begin());
        }
    }
    const std::vector<std::string> said = said_names(description);
    for (std::size_t s = 0; s < layout.extra.size(); ++s) {
        const bool alpha =
            layout.extra[s] == EXTRASAMPLE_ASSOCALPHA || layout.extra[s] == EXTRASAMPLE_UNASSALPHA;
        // Without a word about it, a fourth sample beside RGB is one.
        const bool assumed =
            !layout.has_extra && layout.extra.size() == 1 && layout.colours == 3 && said.empty();
        if (alpha || assumed) names[static_cast<std::size_t>(layout.colours) + s] = "A";
    }
    return said.size() == names.size() ? said : names;
}

/// Settings of codecs that hand out what other kinds of pictures have.
void prepare(TIFF* tiff, const TiffLayout& layout) {
    if (layout.photometric == PHOTOMETRIC_YCBCR && layout.compression == COMPRESSION_JPEG)
        TIFFSetField(tiff, TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
    if (layout.photometric == PHOTOMETRIC_LOGL || layout.photometric == PHOTOMETRIC_LOGLUV)
        TIFFSetField(tiff, TIFFTAG_SGILOGDATAFMT, SGILOGDATAFMT_FLOAT);
}

/// Converts the colours as a whole, whichever of them are among the planes.
void take_tiff_colours(TIFF* tiff, TiffLayout& layout, const ReadOptions& options, Image colours,
                       const ChannelPlan& plan, Picture& picture, const std::string& asked) {
    Picture own;
    own.type = picture.type;
    own.image = std::move(colours);
    interpret_tiff(tiff, layout, options, own, asked);
    std::vector<ColourSpace> spaces(static_cast<std::size_t>(layout.samples), ColourSpace::unspecified);
    for (int c = 0; c < layout.colours; ++c) spaces[static_cast<std::size_t>(c)] = own.image.plane_space(c);
    for (std::size_t p = 0; p < plan.planes.size(); ++p)
        if (const int c = plan.planes[p]; c < layout.colours)
            std::ranges::copy(own.image.plane(c), picture.image.plane(static_cast<int>(p)).begin());
    picture.image.set_plane_spaces(spaces_of(spaces, plan.planes));
    picture.remarks.insert(picture.remarks.end(), own.remarks.begin(), own.remarks.end());
}

/// The least of all alpha channels.
void take_alpha(const TiffLayout& layout, const ChannelPlan& plan, const Image& all, Picture& picture) {
    for (const int channel : plan.alpha) {
        const auto given = all.plane(channel);
        if (picture.alpha.empty())
            picture.alpha.assign(given.begin(), given.end());
        else
            for (std::size_t i = 0; i < given.size(); ++i)
                picture.alpha[i] = std::min(picture.alpha[i], given[i]);
    }
    const bool multiplied = std::ranges::any_of(plan.alpha, [&](int channel) {
        return channel >= layout.colours &&
               layout.extra[static_cast<std::size_t>(channel - layout.colours)] == EXTRASAMPLE_ASSOCALPHA;
    });
    if (multiplied && std::ranges::any_of(picture.alpha, [](float a) { return a != 1.0F; }))
        picture.remarks.emplace_back(associated_alpha_remark);
}

/// Colours as one picture; extra samples stand beside them where they are wanted.
Picture read_samples(TIFF* tiff, TiffLayout& layout, const ReadOptions& options, Crop stored,
                     const TiffPixels& pixels, const std::string& asked) {
    Picture picture;
    picture.type = layout.type();
    const std::string description = tiff_field<const char*>(tiff, TIFFTAG_IMAGEDESCRIPTION).value_or("");
    const std::vector<std::string> names = names_of_samples(layout, description);
    const ChannelPlan plan = plan_channels(names, options.planes, -1, asked);
    bool beyond_float = false;
    Image all = pixels.samples(stored, beyond_float);
    if (beyond_float) picture.remarks.emplace_back(wide_integers_remark);
    tell_no_data(tiff, layout, all, picture);

    std::vector<int> colours(static_cast<std::size_t>(layout.colours));
    for (int s = 0; s < layout.colours; ++s) colours[static_cast<std::size_t>(s)] = s;
    const auto taken = [&](const std::vector<int>& channels) {
        Image image(all.size(), static_cast<int>(channels.size()));
        for (std::size_t p = 0; p < channels.size(); ++p)
            std::ranges::copy(all.plane(channels[p]), image.plane(static_cast<int>(p)).begin());
        return image;
    };
    picture.image = taken(plan.planes);
    // Colours as a whole, alone or apart from other planes.
    const bool whole = plan.planes == colours;
    if (whole) interpret_tiff(tiff, layout, options, picture, asked);
    if (!whole &&
        (layout.photometric == PHOTOMETRIC_PALETTE || layout.photometric == PHOTOMETRIC_SEPARATED ||
         layout.photometric == PHOTOMETRIC_CIELAB || layout.photometric == PHOTOMETRIC_ICCLAB) &&
        !options.keep_values && std::ranges::any_of(plan.planes, [&](int c) { return c < layout.colours; }))
        throw InputError(asked,
                         "its colours have to be converted, and are not read apart or beside other planes",
                         "choose all of them with --planes, or give --keep-values");
    if (!whole && tiff_has_colours(tiff, layout, description))
        take_tiff_colours(tiff, layout, options, taken(colours), plan, picture, asked);
    if (const auto said = said_spaces(description, picture.image.planes()); !whole && said)
        picture.image.set_plane_spaces(*said);
    if (!whole && options.planes.empty() && !options.keep_values && picture.image.plane_spaces().empty() &&
        tiff_hides_meaning(tiff, layout, description))
        picture.remarks.push_back("its " + counted(picture.image.planes(), "plane") +
                                  " are taken for data: the file does not say which are light");
    if (!whole && layout.photometric == PHOTOMETRIC_MINISWHITE && !options.keep_values)
        for (std::size_t p = 0; p < plan.planes.size(); ++p)
            if (plan.planes[p] == 0 && (layout.is_fraction() || layout.is_float()))
                for (float& value : picture.image.plane(static_cast<int>(p))) value = 1.0F - value;
    take_alpha(layout, plan, all, picture);
    if (!said_names(description).empty() && picture.image.planes() == static_cast<int>(plan.names.size()))
        picture.image.set_names(plan.names);
    return picture;
}

constexpr const char* no_palette =
    "it has a palette's indices and no palette (ColorMap), which is not supported";

/// What libtiff says when it cannot take a file's header.
[[noreturn]] void refuse_header(const std::string& message, const std::string& asked) {
    if (message.find("Colormap") != std::string::npos) throw InputError(asked, no_palette, convert_it);
    if (says_unsupported(message))
        throw InputError(asked, "it is of a kind that is not supported (" + message + ")", convert_it);
    throw InputError(asked, message.empty() ? "its header is damaged" : "its header is damaged: " + message,
                     use_a_complete_file);
}

}  // namespace

Picture decode_tiff(const std::filesystem::path& path, const ReadOptions& options, std::uintmax_t file_bytes,
                    const std::string& asked) {
    std::string message;
    const Tiff tiff = open_tiff(path, message);
    if (!tiff) refuse_header(message, asked);
    const std::vector<TiffDirectory> directories = tiff_directories(tiff.get());
    std::vector<Part> parts;
    parts.reserve(directories.size());
    for (const TiffDirectory& each : directories) parts.push_back(each.part);
    const int number = chosen_part(parts, options.part, asked);
    message.clear();
    const std::uint64_t offset = directories[static_cast<std::size_t>(number)].offset;
    if (TIFFSetSubDirectory(tiff.get(), offset) != 1) refuse_header(message, asked);
    TiffLayout layout = tiff_layout(tiff.get());
    check_tiff_layout(layout, tiff.get(), file_bytes, asked);
    if (layout.photometric != PHOTOMETRIC_PALETTE &&
        stored_tiff_word(path, offset, TIFFTAG_PHOTOMETRIC) == PHOTOMETRIC_PALETTE)
        throw InputError(asked, no_palette, convert_it);
    prepare(tiff.get(), layout);
    const bool shown = layout.compression == COMPRESSION_OJPEG ||
                       (layout.photometric == PHOTOMETRIC_YCBCR && layout.compression != COMPRESSION_JPEG);
    layout = tiff_layout(tiff.get());
    const Orientation orientation(layout.orientation);
    const Crop crop = checked_crop(options.crop, orientation.upright(layout.size), asked);
    const Crop stored = orientation.stored(crop, layout.size);
    const TiffPixels pixels(tiff.get(), layout, message, asked);
    try {
        Picture picture;
        if (shown) {
            picture.image = pixels.shown(stored);
            picture.image.set_space(ColourSpace::srgb);
            apply_meaning(picture, tiff_colour_meaning(tiff.get(), layout), options.keep_values);
            keep_planes(picture, plan_channels(channel_names(3), options.planes, -1, asked));
        } else {
            picture = read_samples(tiff.get(), layout, options, stored, pixels, asked);
        }
        make_upright(picture, orientation);
        return picture;
    } catch (const std::bad_alloc&) {
        throw InputError(asked,
                         compact_text_of(crop) + " pixels of " + std::to_string(layout.samples) +
                             " samples do not fit in memory",
                         "crop the picture");
    }
}

}  // namespace btfield::detail
