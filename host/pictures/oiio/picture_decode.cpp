#include "host/pictures/oiio/picture_decode.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <new>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/pictures/channels.hpp"
#include "host/pictures/colour.hpp"
#include "host/pictures/container_chunks.hpp"
#include "host/pictures/exif.hpp"
#include "host/pictures/oiio/exr_header.hpp"
#include "host/pictures/oiio/oiio_handle.hpp"
#include "host/pictures/oiio/tiff_decode.hpp"
#include "host/pictures/orientation.hpp"
#include "host/pictures/picture_names.hpp"
#include "host/pictures/png_colours.hpp"
#include "host/pictures/unnamed_channels.hpp"

namespace btfield::detail {
namespace {

PixelType type_of(const OIIO::ImageSpec& spec) {
    std::vector<OIIO::TypeDesc> types = spec.channelformats;
    if (types.empty()) types.push_back(spec.format);
    const auto all = [&](auto... wanted) {
        return std::all_of(types.begin(), types.end(),
                           [&](const OIIO::TypeDesc& t) { return ((t.basetype == wanted) || ...); });
    };
    if (all(OIIO::TypeDesc::UINT8)) return PixelType::uint8;
    if (all(OIIO::TypeDesc::UINT8, OIIO::TypeDesc::UINT16)) return PixelType::uint16;
    if (all(OIIO::TypeDesc::HALF)) return PixelType::half;
    return PixelType::float32;
}

std::optional<Chromaticities> chromaticities_of(const OIIO::ImageSpec& spec) {
    const auto* found = spec.find_attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8));
    if (found == nullptr) return std::nullopt;
    Chromaticities result{};
    std::copy_n(static_cast<const float*>(found->data()), result.size(), result.begin());
    return result;
}

bool is_xyz(const OIIO::ImageSpec& spec) {
    if (const auto given = chromaticities_of(spec)) {
        return same_primaries(*given, Chromaticities{1, 0, 0, 1, 0, 0, 1.0 / 3.0, 1.0 / 3.0}, 1e-3);
    }
    std::string space = spec.get_string_attribute("oiio:ColorSpace");
    std::transform(space.begin(), space.end(), space.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return space == "xyz" || space == "cie xyz" || space == "ciexyz";
}

ColourSpace space_of(const OIIO::ImageSpec& spec, PictureFormat format, PixelType type,
                     const ChannelPlan& plan) {
    if (plan.planes.size() != 3) return ColourSpace::unspecified;
    if (const auto said = said_space(spec.get_string_attribute("ImageDescription"))) return *said;
    if (is_xyz(spec)) return ColourSpace::xyz;
    if (format == PictureFormat::exr) return plan.colours.value_or(ColourSpace::unspecified);
    if (plan.colours != ColourSpace::linear) return ColourSpace::unspecified;
    if (type == PixelType::half || type == PixelType::float32) return ColourSpace::linear;
    return spec.get_string_attribute("oiio:ColorSpace") == "Linear" ? ColourSpace::linear : ColourSpace::srgb;
}

void check_header(const OIIO::ImageSpec& spec, std::uintmax_t file_bytes, const std::string& asked) {
    if (spec.deep || spec.depth > 1) {
        throw InputError(asked, spec.deep ? "it is a deep picture" : "it is a volume", "give a flat picture");
    }
    if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1) {
        throw InputError(asked, "its header says " + compact_size_text(spec.width, spec.height) + " pixels",
                         use_a_complete_file);
    }
    check_packing({spec.height, spec.width},
                  static_cast<double>(spec.width) * static_cast<double>(spec.nchannels) *
                      static_cast<double>(spec.format.size()),
                  file_bytes, asked);
}

/// What the codec says, told apart: a kind that it does not know, or damage.
[[noreturn]] void refuse_codec(OIIO::ImageInput& input, const char* otherwise, const std::string& asked) {
    const std::string found = message_of(input, otherwise);
    if (says_unsupported(found))
        throw InputError(asked, "it is of a kind that is not supported (" + found + ")", convert_it);
    throw InputError(asked, found, use_a_complete_file);
}

/// Values of one channel in an interleaved row, as the library scales them.
template <class T>
void take_channel(const T* from, std::size_t stride, std::span<float> to) {
    for (std::size_t i = 0; i < to.size(); ++i) {
        if constexpr (std::is_integral_v<T> && sizeof(T) < 4) {
            to[i] = static_cast<float>(from[i * stride]) / static_cast<float>(std::numeric_limits<T>::max());
        } else {
            to[i] = static_cast<float>(from[i * stride]);
        }
    }
}

/// Where the rows of one channel go.
struct Sink {
    int channel = 0;
    std::span<float> values;
};

/// What is decoded: a part of the file and its channels from `begin` to before `end`.
struct Source {
    OIIO::ImageInput& input;
    const OIIO::ImageSpec& spec;
    int part = 0, begin = 0, end = 0;
};

/// Decodes the crop strip by strip as T and hands every channel's rows to its sink.
template <class T>
void read_rows(const Source& source, Crop crop, const std::vector<Sink>& sinks, const std::string& asked) {
    const auto format = OIIO::BaseTypeFromC<T>::value;
    const OIIO::ImageSpec& spec = source.spec;
    const bool tiled = spec.tile_width > 0;
    // Codecs hand out whole rows, or whole tiles.
    const auto down = [](int v, int step) { return v - v % step; };
    const int x_begin = tiled ? down(crop.x, spec.tile_width) : 0;
    const int x_end = tiled ? std::min(spec.width, crop.x + crop.width + spec.tile_width -
                                                       (crop.x + crop.width - 1) % spec.tile_width - 1)
                            : spec.width;
    const int rows = tiled ? spec.tile_height : strip_rows;
    const auto columns = static_cast<std::size_t>(x_end - x_begin);
    const auto channels = static_cast<std::size_t>(source.end - source.begin);
    std::vector<T> strip(columns * channels * static_cast<std::size_t>(std::min(rows, spec.height)));

    for (int y = down(crop.y, rows); y < crop.y + crop.height; y += rows) {
        const int y_end = std::min(y + rows, spec.height);
        const bool read =
            tiled ? source.input.read_tiles(source.part, 0, spec.x + x_begin, spec.x + x_end, spec.y + y,
                                            spec.y + y_end, spec.z, spec.z + 1, source.begin, source.end,
                                            format, strip.data())
                  : source.input.read_scanlines(source.part, 0, spec.y + y, spec.y + y_end, spec.z,
                                                source.begin, source.end, format, strip.data());
        if (!read) refuse_codec(source.input, "its pixels cannot be decoded", asked);
        for (int row = std::max(y, crop.y); row < std::min(y_end, crop.y + crop.height); ++row) {
            const std::size_t from =
                (static_cast<std::size_t>(row - y) * columns + static_cast<std::size_t>(crop.x - x_begin)) *
                channels;
            const auto width = static_cast<std::size_t>(crop.width);
            for (const Sink& sink : sinks) {
                take_channel(strip.data() + from + (sink.channel - source.begin), channels,
                             sink.values.subspan(static_cast<std::size_t>(row - crop.y) * width, width));
            }
        }
    }
}

bool is_wide_integer(const OIIO::ImageSpec& spec, int channel) {
    const auto base = static_cast<OIIO::TypeDesc::BASETYPE>(spec.channelformat(channel).basetype);
    return base == OIIO::TypeDesc::UINT32 || base == OIIO::TypeDesc::INT32;
}

/// Whole numbers of 32 bits keep their unit: OpenImageIO would scale them.
void read_wide_integers(Source source, Crop crop, const std::vector<Sink>& sinks, Picture& picture,
                        const std::string& asked) {
    bool told = false;
    for (const Sink& sink : sinks) {
        if (!is_wide_integer(source.spec, sink.channel)) continue;
        source.begin = sink.channel;
        source.end = sink.channel + 1;
        read_rows<std::uint32_t>(source, crop, {sink}, asked);
        told = told || std::ranges::any_of(sink.values, [](float v) { return std::abs(v) > 16777216.0F; });
    }
    if (told) picture.remarks.emplace_back(wide_integers_remark);
}

/// Type, planes and alpha of the crop; alpha stands beside the planes.
Picture read_crop(const Source& source, PictureFormat format, const ChannelPlan& plan, Crop crop,
                  const std::string& asked) {
    const OIIO::ImageSpec& spec = source.spec;
    Picture picture;
    picture.type = type_of(spec);
    try {
        picture.image = Image({crop.height, crop.width}, static_cast<int>(plan.planes.size()),
                              space_of(spec, format, picture.type, plan));
        std::vector<Sink> sinks;
        for (std::size_t p = 0; p < plan.planes.size(); ++p)
            sinks.push_back({plan.planes[p], picture.image.plane(static_cast<int>(p))});
        const std::size_t pixels = area(picture.image.size());
        std::vector<float> alphas(pixels * plan.alpha.size());
        for (std::size_t a = 0; a < plan.alpha.size(); ++a)
            sinks.push_back({plan.alpha[a], std::span(alphas).subspan(a * pixels, pixels)});
        switch (picture.type) {
            case PixelType::uint8:
                read_rows<unsigned char>(source, crop, sinks, asked);
                break;
            case PixelType::uint16:
                read_rows<unsigned short>(source, crop, sinks, asked);
                break;
            default:
                read_rows<float>(source, crop, sinks, asked);
                read_wide_integers(source, crop, sinks, picture, asked);
        }
        if (!plan.alpha.empty())
            picture.alpha.assign(alphas.begin(), alphas.begin() + static_cast<std::ptrdiff_t>(pixels));
        for (std::size_t i = pixels; i < alphas.size(); ++i)
            picture.alpha[i % pixels] = std::min(picture.alpha[i % pixels], alphas[i]);
    } catch (const std::bad_alloc&) {
        throw InputError(asked,
                         compact_text_of(crop) + " pixels of " + std::to_string(spec.nchannels) +
                             " channels do not fit in memory",
                         "crop the picture");
    }
    return picture;
}

/// The file's pictures; those of one that has a single one are not looked at.
std::vector<Part> parts_of(OIIO::ImageInput& input) {
    std::vector<Part> parts;
    for (int i = 0; input.seek_subimage(i, 0); ++i) {
        const OIIO::ImageSpec& spec = input.spec();
        parts.push_back({spec.get_string_attribute("oiio:subimagename"),
                         compact_size_text(spec.width, spec.height) + ", " + std::to_string(spec.nchannels) +
                             (spec.nchannels == 1 ? " channel" : " channels"),
                         spec.deep});
    }
    if (input.has_error()) static_cast<void>(input.geterror());  // that there is no further one
    return parts;
}

/// Colours of layers beside other planes: what a texture says of primaries would be said of all of its
/// planes.
void convert_layers(const Chromaticities& given, Picture& picture) {
    const std::vector<std::array<int, 3>> layers = colour_layers(picture.image.names());
    const std::optional<Matrix3> matrix = rec709_from(given);
    if (layers.empty() || !matrix) {
        picture.remarks.emplace_back(
            "its primaries (chromaticities) are not Rec. 709, and planes stay in them");
        return;
    }
    for (const std::array<int, 3>& planes : layers) {
        Image colours(picture.image.size(), 3, ColourSpace::linear);
        for (int p = 0; p < 3; ++p)
            std::ranges::copy(picture.image.plane(planes.at(static_cast<std::size_t>(p))),
                              colours.plane(p).begin());
        transform(colours, *matrix);
        for (int p = 0; p < 3; ++p)
            std::ranges::copy(colours.plane(p),
                              picture.image.plane(planes.at(static_cast<std::size_t>(p))).begin());
    }
    picture.remarks.emplace_back(
        "its primaries (chromaticities) are not Rec. 709, and its colours were converted; textures are in "
        "Rec. 709");
}

/// What is left when values have been read: primaries to convert, windows to tell of.
void understand_exr(const OIIO::ImageSpec& spec, const ReadOptions& options, Picture& picture) {
    const std::optional<Chromaticities> given = chromaticities_of(spec);
    if (given && picture.image.space() == ColourSpace::linear && !same_primaries(*given, rec709)) {
        const std::optional<Matrix3> matrix = rec709_from(*given);
        if (!matrix) {
            picture.remarks.emplace_back("its chromaticities span no colours, and Rec. 709 is assumed");
        } else {
            picture.chromaticities = given;
            if (options.keep_values) {
                picture.image.set_space(ColourSpace::unspecified);
            } else {
                transform(picture.image, *matrix);
                picture.remarks.emplace_back(
                    "its primaries (chromaticities) are not Rec. 709, and its colours were converted");
            }
        }
    }
    const bool several = picture.image.planes() > 1 && picture.image.space() == ColourSpace::unspecified;
    const bool converted = std::ranges::count(picture.image.plane_spaces(), ColourSpace::xyz) > 0;
    if (given && several && !converted && !same_primaries(*given, rec709)) {
        if (options.keep_values)
            picture.image.set_plane_spaces({});
        else
            convert_layers(*given, picture);
    }
    if (spec.x != spec.full_x || spec.y != spec.full_y || spec.width != spec.full_width ||
        spec.height != spec.full_height)
        picture.remarks.push_back("its data window, " + compact_size_text(spec.width, spec.height) +
                                  " pixels, is read, not its display window of " +
                                  compact_size_text(spec.full_width, spec.full_height));
    const float aspect = spec.get_float_attribute("PixelAspectRatio", 1.0F);
    if (std::abs(aspect - 1.0F) > 1e-3F)
        picture.remarks.emplace_back("its pixels are not square, and are taken as square");
}

struct OpenFile {
    Reader input;
    std::vector<Part> parts;
    OIIO::ImageSpec spec;
    int part = 0;
};

void open_file(OpenFile& file, const std::filesystem::path& path, PictureFormat format,
               const std::string& wanted, const std::string& asked) {
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);  // colours as stored, not multiplied by alpha
    file.input.reset(OIIO::ImageInput::create(std::string(codec_name(format))).release());
    if (!file.input) throw InputError(asked, OIIO::geterror(), "install OpenImageIO with this format");
    if (!file.input->open(path.string(), file.spec, config))
        refuse_codec(*file.input, "its header cannot be decoded", asked);
    file.parts = parts_of(*file.input);
    file.part = chosen_part(file.parts, wanted, asked);
    // Its decoder does not go back.
    if (format == PictureFormat::webp &&
        !(file.input->close() && file.input->open(path.string(), file.spec, config)))
        refuse_codec(*file.input, "its header cannot be decoded", asked);
    if (!file.input->seek_subimage(file.part, 0))
        refuse_codec(*file.input, "that part cannot be decoded", asked);
    file.spec = file.input->spec();
}

/// A profile says more than code points do.
Surroundings surroundings_of(const ContainerChunks& chunks, const std::string& asked) {
    Surroundings result;
    result.exif = read_exif(chunks.exif);
    take_xmp(result.exif, chunks.xmp);
    if (!chunks.profile.empty()) {
        result.meaning.profile = chunks.profile;
    } else if (!chunks.code_points.empty()) {
        result.meaning = meaning_of_code_points(chunks.code_points, "nclx", result.remark, asked);
    }
    return result;
}

Surroundings surroundings_of(const std::filesystem::path& path, PictureFormat format,
                             const OIIO::ImageSpec& spec, const std::string& asked) {
    const std::string bytes = file_content(path);
    Surroundings result =
        surroundings_of(format == PictureFormat::webp ? webp_chunks(bytes) : heif_chunks(bytes), asked);
    result.description = spec.get_string_attribute("ImageDescription");
    return result;
}

/// Of formats whose channels have no names.
Picture read_unnamed(OpenFile& file, PictureFormat format, const Surroundings& around,
                     const ReadOptions& options, const std::string& asked) {
    const OIIO::ImageSpec& spec = file.spec;
    const Orientation orientation(around.exif.orientation);
    const Size size{spec.height, spec.width};
    const Crop crop = checked_crop(options.crop, orientation.upright(size), asked);
    const ChannelPlan all = plan_channels(channel_names(spec.nchannels), {}, spec.alpha_channel, asked);
    Picture picture = read_crop({*file.input, spec, file.part, 0, spec.nchannels}, format, all,
                                orientation.stored(crop, size), asked);
    understand_unnamed(picture, spec.nchannels, spec.alpha_channel, around, options, asked);
    return picture;
}

Picture read_named(OpenFile& file, PictureFormat format, const ReadOptions& options,
                   const std::string& asked) {
    const OIIO::ImageSpec& spec = file.spec;
    const ChannelPlan plan = plan_channels(spec.channelnames, options.planes, -1, asked);
    const Crop crop = checked_crop(options.crop, {spec.height, spec.width}, asked);
    Picture picture = read_crop({*file.input, spec, file.part, 0, spec.nchannels}, format, plan, crop, asked);
    picture.image.set_names(plan.names);
    if (std::ranges::any_of(picture.alpha, [](float a) { return a != 1.0F; }))
        picture.remarks.emplace_back(associated_alpha_remark);
    if (picture.image.space() == ColourSpace::unspecified) {
        const auto said = said_spaces(spec.get_string_attribute("ImageDescription"), picture.image.planes());
        picture.image.set_plane_spaces(said ? *said
                                            : spaces_of(spaces_of_channels(spec.channelnames), plan.planes));
    }
    understand_exr(spec, options, picture);
    return picture;
}

}  // namespace

Picture decode_picture(const std::filesystem::path& path, PictureFormat format, const ReadOptions& options,
                       std::uintmax_t file_bytes, const std::string& asked) {
    if (format == PictureFormat::tiff) return decode_tiff(path, options, file_bytes, asked);
    OpenFile file;
    if (format == PictureFormat::exr) check_exr_header(path, file_bytes, asked);
    open_file(file, path, format, options.part, asked);
    check_header(file.spec, file_bytes, asked);
    Picture picture =
        format == PictureFormat::exr
            ? read_named(file, format, options, asked)
            : read_unnamed(file, format, surroundings_of(path, format, file.spec, asked), options, asked);
    // Damage that the decoder could paint over is reported only here.
    if (file.input->has_error()) refuse_codec(*file.input, "it is damaged", asked);
    return picture;
}

}  // namespace btfield::detail
