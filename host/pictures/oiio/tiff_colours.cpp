#include "host/pictures/oiio/tiff_colours.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "host/pictures/channels.hpp"
#include "host/pictures/colour.hpp"

namespace btfield::detail {
namespace {

/// Indices become colours.
Image looked_up(TIFF* tiff, const Image& indices, TiffLayout& layout, const std::string& asked) {
    std::array<const std::uint16_t*, 3> maps{};
    if (TIFFGetField(tiff, TIFFTAG_COLORMAP, &maps[0], &maps[1], &maps[2]) != 1)
        throw InputError(asked, "it has no palette for its indices", use_a_complete_file);
    const auto count = static_cast<std::size_t>(layout.largest()) + 1;
    // Entries of 8 bits are stored twice over, shifted up, or, wrongly, as they are.
    bool twice = true, shifted = true, plain = true;
    for (const std::uint16_t* map : maps)
        for (std::size_t i = 0; i < count; ++i) {
            twice = twice && map[i] % 257 == 0;
            shifted = shifted && map[i] % 256 == 0;
            plain = plain && map[i] < 256;
        }
    const int down = twice ? 257 : shifted ? 256 : 1;
    const float top = twice || shifted || plain ? 255.0F : 65535.0F;
    Image result(indices.size(), 3);
    for (std::size_t i = 0; i < area(indices.size()); ++i) {
        const auto index = static_cast<std::size_t>(
            std::lround(static_cast<double>(indices.plane(0)[i]) * layout.largest()));
        for (int p = 0; p < 3; ++p) {
            const int value = maps[static_cast<std::size_t>(p)][index] / down;  // whole steps
            result.plane(p)[i] = static_cast<float>(value) / top;
        }
    }
    layout.bits = top == 255.0F ? 8 : 16;
    return result;
}

/// Values of a L*a*b* sample triple, as its encoding has them.
std::array<double, 3> lab_of(const TiffLayout& layout, std::array<double, 3> stored) {
    if (!layout.is_fraction()) return stored;
    const bool wide = layout.bits == 16;
    const double top = layout.largest();
    if (layout.photometric == PHOTOMETRIC_ICCLAB) {
        const double scale = wide ? 65280.0 : 255.0;
        const auto centred = [&](double v) { return wide ? v * top / 256.0 - 128.0 : v * top - 128.0; };
        return {stored[0] * top * 100.0 / scale, centred(stored[1]), centred(stored[2])};
    }
    // a* and b* in two's complement.
    const auto about_zero = [&](double v) {
        const double whole = v * top;
        const double value = whole > top / 2.0 ? whole - top - 1.0 : whole;
        return wide ? value / 256.0 : value;
    };
    return {stored[0] * 100.0, about_zero(stored[1]), about_zero(stored[2])};
}

void convert_lab(TIFF* tiff, const TiffLayout& layout, Picture& picture) {
    std::array<double, 2> white{0.34567, 0.35850};  // D50, as all who write it have it
    if (const auto given = tiff_field<const float*>(tiff, TIFFTAG_WHITEPOINT); given && (*given)[1] > 0.0F)
        white = {static_cast<double>((*given)[0]), static_cast<double>((*given)[1])};
    const std::array<double, 3> xyz_white{white[0] / white[1], 1.0, (1.0 - white[0] - white[1]) / white[1]};
    const auto back = [](double t) {
        constexpr double delta = 6.0 / 29.0;
        return t > delta ? t * t * t : 3.0 * delta * delta * (t - 4.0 / 29.0);
    };
    Image& image = picture.image;
    for (std::size_t i = 0; i < area(image.size()); ++i) {
        const std::array<double, 3> lab =
            lab_of(layout, {image.plane(0)[i], image.plane(1)[i], image.plane(2)[i]});
        const double y = (lab[0] + 16.0) / 116.0;
        image.plane(0)[i] = static_cast<float>(xyz_white[0] * back(y + lab[1] / 500.0));
        image.plane(1)[i] = static_cast<float>(back(y));
        image.plane(2)[i] = static_cast<float>(xyz_white[2] * back(y - lab[2] / 200.0));
    }
    transform(image, adaptation(white, {rec709[6], rec709[7]}));
    image.set_space(ColourSpace::xyz);
    const bool integer = layout.is_fraction();
    convert(image, integer ? ColourSpace::srgb : ColourSpace::linear);
    picture.remarks.push_back(std::string("its colours are CIE L*a*b*, and became ") +
                              (integer ? "sRGB" : "linear Rec. 709"));
}

constexpr std::uint32_t gdal_metadata_tag = 42112;

/// Whether the picture is a map of the earth: its values are measured.
bool is_map(TIFF* tiff) {
    constexpr std::array<std::uint32_t, 5> tags{33550, 33922, 34735, gdal_metadata_tag, gdal_nodata_tag};
    return std::ranges::any_of(tags, [&](std::uint32_t tag) { return has_tiff_tag(tiff, tag); });
}

/// Light by the file's TransferFunction: a table of all values for each colour, or for all of them.
void take_transfer(TIFF* tiff, const TiffLayout& layout, ColourMeaning& meaning) {
    std::array<const std::uint16_t*, 3> tables{};
    if (!layout.is_fraction() ||
        TIFFGetField(tiff, TIFFTAG_TRANSFERFUNCTION, &tables[0], &tables[1], &tables[2]) != 1)
        return;
    const std::size_t count = std::size_t{1} << layout.bits;
    bool straight = true, screens = true;
    std::array<std::vector<double>, 3> curves;
    for (std::size_t p = 0; p < 3; ++p) {
        const std::uint16_t* const table = tables.at(p) != nullptr ? tables.at(p) : tables[0];
        std::vector<double>& curve = curves.at(p);
        for (std::size_t i = 0; i < count; ++i) {
            const double value = static_cast<double>(i) / static_cast<double>(count - 1);
            curve.push_back(table[i] / 65535.0);
            straight = straight && std::abs(curve.back() - value) < 2e-3;
            screens = screens && std::abs(srgb_encoded(curve.back()) - value) < 4e-3;
        }
        // White at 0 has been turned by then.
        if (layout.photometric == PHOTOMETRIC_MINISWHITE) std::ranges::reverse(curve);
    }
    if (screens) return;
    if (straight)
        meaning.exponent = 1.0;
    else
        meaning.curves = std::move(curves);
    meaning.said_by = "from what its TransferFunction says";
}

/// Black and white of a file's ReferenceBlackWhite, where they are not the ends of its range, to 0 and 1.
void apply_reference(TIFF* tiff, const TiffLayout& layout, Picture& picture) {
    const auto given = tiff_field<const float*>(tiff, TIFFTAG_REFERENCEBLACKWHITE);
    if (!given || picture.image.planes() != 3) return;
    const std::span<const float> reference(*given, 6);
    const auto top = static_cast<float>(layout.largest());
    const bool chroma = layout.photometric == PHOTOMETRIC_YCBCR;
    const std::array<float, 6> usual{0.0F, top, chroma ? 128.0F : 0.0F, top, chroma ? 128.0F : 0.0F, top};
    if (std::ranges::equal(reference, usual, [](float a, float b) { return std::abs(a - b) < 0.5F; })) return;
    bool sound = layout.is_fraction() && !chroma;
    for (std::size_t p = 0; p < 3; ++p) sound = sound && reference[2 * p + 1] - reference[2 * p] > 0.5F;
    if (!sound) {
        picture.remarks.emplace_back("its ReferenceBlackWhite was ignored");
        return;
    }
    for (int p = 0; p < 3; ++p) {
        const float black = reference[2 * static_cast<std::size_t>(p)],
                    white = reference[2 * static_cast<std::size_t>(p) + 1];
        for (float& value : picture.image.plane(p)) value = (value * top - black) / (white - black);
    }
    picture.remarks.emplace_back("black and white were set to 0 and 1 by what its ReferenceBlackWhite says");
}

/// What one plane of grey is before profile or primaries are looked at: numbers with a unit, and those of
/// maps, are no light.
ColourSpace grey_space(TIFF* tiff, const TiffLayout& layout, const std::string& description) {
    if (const auto said = said_spaces(description, 1)) return said->front();
    const std::vector<std::string> names = said_names(description);
    if (!names.empty() && names.front() != "Y") return ColourSpace::unspecified;
    if (layout.is_fraction()) return ColourSpace::srgb;
    if (!layout.is_float() || is_map(tiff)) return ColourSpace::unspecified;
    return ColourSpace::linear;
}

/// Space that numbers have before profile or primaries are looked at.
ColourSpace plain_space(const TiffLayout& layout, const std::string& description) {
    if (const auto said = said_space(description)) return *said;
    return layout.is_fraction() ? ColourSpace::srgb : ColourSpace::linear;
}

}  // namespace

ColourMeaning tiff_colour_meaning(TIFF* tiff, const TiffLayout& layout) {
    ColourMeaning meaning;
    if (layout.photometric != PHOTOMETRIC_PALETTE) take_transfer(tiff, layout, meaning);
    std::uint32_t bytes = 0;
    const void* profile = nullptr;
    if (TIFFGetField(tiff, TIFFTAG_ICCPROFILE, &bytes, &profile) == 1 && bytes > 0)
        meaning.profile.assign(static_cast<const char*>(profile), bytes);
    const auto primaries = tiff_field<const float*>(tiff, TIFFTAG_PRIMARYCHROMATICITIES);
    const auto white = tiff_field<const float*>(tiff, TIFFTAG_WHITEPOINT);
    if (layout.photometric == PHOTOMETRIC_RGB && primaries) {
        Chromaticities& given = meaning.primaries.emplace(rec709);
        std::copy_n(*primaries, 6, given.begin());
        if (white) std::copy_n(*white, 2, given.begin() + 6);
        meaning.said_by = meaning.said_by.empty()
                              ? "from what its PrimaryChromaticities say"
                              : "from what its PrimaryChromaticities and TransferFunction say";
    }
    return meaning;
}

void interpret_tiff(TIFF* tiff, TiffLayout& layout, const ReadOptions& options, Picture& picture,
                    const std::string& asked) {
    Image& image = picture.image;
    const std::string description = tiff_field<const char*>(tiff, TIFFTAG_IMAGEDESCRIPTION).value_or("");
    const bool keeps_white = layout.photometric == PHOTOMETRIC_MINISWHITE && options.keep_values;
    if (image.planes() == 1 && !keeps_white) image.set_plane_spaces({grey_space(tiff, layout, description)});
    switch (layout.photometric) {
        case PHOTOMETRIC_MINISWHITE:
            if (options.keep_values || !(layout.is_fraction() || layout.is_float())) return;
            for (float& value : image.values()) value = 1.0F - value;
            if (layout.is_float())
                picture.remarks.emplace_back("its floats have white at 0, and became 1 - value");
            break;
        case PHOTOMETRIC_PALETTE:
            image = looked_up(tiff, image, layout, asked);
            picture.type = layout.type();
            image.set_space(ColourSpace::srgb);
            break;
        case PHOTOMETRIC_LOGL:
            image.set_space(ColourSpace::linear);
            return;
        case PHOTOMETRIC_LOGLUV:
            image.set_space(ColourSpace::xyz);
            return;
        case PHOTOMETRIC_CIELAB:
        case PHOTOMETRIC_ICCLAB:
            if (!options.keep_values) convert_lab(tiff, layout, picture);
            return;
        case PHOTOMETRIC_SEPARATED:
            break;
        default:
            if (image.planes() == 3) image.set_space(plain_space(layout, description));
            if (const auto said = said_spaces(description, image.planes()); image.planes() == 3 && said)
                if (image.space() == ColourSpace::unspecified) image.set_plane_spaces(*said);
    }
    if (!said_space(description)) {
        const bool rgb = layout.photometric == PHOTOMETRIC_RGB || layout.photometric == PHOTOMETRIC_YCBCR;
        if (rgb && !options.keep_values) apply_reference(tiff, layout, picture);
        const ColourMeaning meaning = tiff_colour_meaning(tiff, layout);
        apply_meaning(picture, meaning, options.keep_values);
        const auto white = tiff_field<const float*>(tiff, TIFFTAG_WHITEPOINT);
        const bool alone = rgb && white && meaning.profile.empty() && !meaning.primaries;
        if (alone && !(std::abs((*white)[0] - 0.3127F) < 4e-3F && std::abs((*white)[1] - 0.3290F) < 4e-3F))
            picture.remarks.emplace_back(
                "its WhitePoint stands without PrimaryChromaticities, and was ignored");
    }
    if (layout.photometric == PHOTOMETRIC_SEPARATED && image.planes() == 4)
        convert_cmyk(picture, options.keep_values);
}

bool tiff_has_colours(TIFF* tiff, const TiffLayout& layout, const std::string& description) {
    if (layout.colours != 3 ||
        (layout.photometric != PHOTOMETRIC_RGB && layout.photometric != PHOTOMETRIC_YCBCR))
        return false;
    if (const auto said = said_spaces(description, layout.samples))
        return said->front() != ColourSpace::unspecified;
    const std::vector<std::string> names = said_names(description);
    if (static_cast<int>(names.size()) == layout.samples) {
        const std::vector<ColourSpace> spaces = spaces_of_channels(names);
        return std::all_of(spaces.begin(), spaces.begin() + 3,
                           [](ColourSpace s) { return s == ColourSpace::linear; });
    }
    constexpr int most_beside = 2;
    const ColourMeaning meaning = tiff_colour_meaning(tiff, layout);
    return layout.samples <= 3 + most_beside || !meaning.profile.empty() || meaning.primaries ||
           !meaning.curves.front().empty();
}

bool tiff_hides_meaning(TIFF* tiff, const TiffLayout& layout, const std::string& description) {
    const bool light = layout.photometric == PHOTOMETRIC_RGB ||
                       layout.photometric == PHOTOMETRIC_MINISBLACK ||
                       layout.photometric == PHOTOMETRIC_MINISWHITE;
    return light && layout.is_fraction() && said_names(description).empty() &&
           !said_spaces(description, layout.samples) && !is_map(tiff);
}

}  // namespace btfield::detail
