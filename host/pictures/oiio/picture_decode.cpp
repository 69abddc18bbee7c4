#include "host/pictures/oiio/picture_decode.hpp"

#include <OpenImageIO/filesystem.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <limits>
#include <new>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/pictures/oiio/oiio_handle.hpp"
#include "host/pictures/oiio/png_frame.hpp"
#include "host/pictures/picture_names.hpp"

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

bool is_xyz(const OIIO::ImageSpec& spec) {
    const auto* chromaticities =
        spec.find_attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8));
    if (chromaticities != nullptr) {
        const auto* given = static_cast<const float*>(chromaticities->data());
        // Writers round 1/3 to as few as three digits.
        return std::equal(xyz_chromaticities.begin(), xyz_chromaticities.end(), given,
                          [](float x, float y) { return std::abs(x - y) < 1e-3F; });
    }
    std::string space = spec.get_string_attribute("oiio:ColorSpace");
    std::transform(space.begin(), space.end(), space.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return space == "xyz" || space == "cie xyz" || space == "ciexyz";
}

/// Part of an EXR channel name behind its layers.
std::string_view last_name(std::string_view name) {
    return name.substr(name.rfind('.') + 1);
}

ColourSpace space_of(const OIIO::ImageSpec& spec, PictureFormat format, PixelType type,
                     const std::vector<int>& planes) {
    if (planes.size() != 3) return ColourSpace::unspecified;
    const std::string description = spec.get_string_attribute("ImageDescription");
    if (const auto at = description.find(space_mark); at != std::string::npos) {
        const std::string_view said = std::string_view(description).substr(at + space_mark.size());
        for (const auto& [space, word] : names_of<ColourSpace>()) {
            if (said.starts_with(word)) return space;
        }
    }
    if (is_xyz(spec)) return ColourSpace::xyz;
    if (format == PictureFormat::exr) {
        std::string names;
        for (const int c : planes) names += last_name(spec.channel_name(c));
        if (names == "XYZ") return ColourSpace::xyz;
        return names == "RGB" ? ColourSpace::linear : ColourSpace::unspecified;
    }
    if (type == PixelType::half || type == PixelType::float32) return ColourSpace::linear;
    return spec.get_string_attribute("oiio:ColorSpace") == "Linear" ? ColourSpace::linear : ColourSpace::srgb;
}

void check_header(const OIIO::ImageSpec& spec, PictureFormat format, std::uintmax_t file_bytes,
                  const std::string& asked) {
    if (spec.deep || spec.depth > 1) {
        throw InputError(asked, spec.deep ? "it is a deep picture" : "it is a volume", "give a flat picture");
    }
    if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1) {
        throw InputError(asked, "its header says " + compact_size_text(spec.width, spec.height) + " pixels",
                         use_a_complete_file);
    }
    if (format == PictureFormat::tiff && spec.format.size() > 4) {
        // OpenImageIO 2.4 decodes them to zeros without a word.
        throw InputError(asked, "it is a TIFF of 64-bit values", "convert it to 32-bit float");
    }
    check_packing({spec.height, spec.width},
                  static_cast<double>(spec.width) * static_cast<double>(spec.nchannels) *
                      static_cast<double>(spec.format.size()),
                  file_bytes, asked);
}

/// Values of one channel in an interleaved row, as the library scales them.
template <class T>
void take_channel(const T* from, std::size_t stride, std::span<float> to) {
    for (std::size_t i = 0; i < to.size(); ++i) {
        if constexpr (std::is_integral_v<T>) {
            to[i] = static_cast<float>(from[i * stride]) / static_cast<float>(std::numeric_limits<T>::max());
        } else {
            to[i] = from[i * stride];
        }
    }
}

/// Where the rows of one channel go.
struct Sink {
    int channel = 0;
    std::span<float> values;
};

/// Decodes the crop strip by strip as T and hands every channel's rows to its sink.
template <class T>
void read_rows(OIIO::ImageInput& input, const OIIO::ImageSpec& spec, Crop crop,
               const std::vector<Sink>& sinks, const std::string& asked) {
    const auto format = OIIO::BaseTypeFromC<T>::value;
    const bool tiled = spec.tile_width > 0;
    // Codecs hand out whole rows, or whole tiles.
    const auto down = [](int v, int step) { return v - v % step; };
    const int x_begin = tiled ? down(crop.x, spec.tile_width) : 0;
    const int x_end = tiled ? std::min(spec.width, crop.x + crop.width + spec.tile_width -
                                                       (crop.x + crop.width - 1) % spec.tile_width - 1)
                            : spec.width;
    const int rows = tiled ? spec.tile_height : strip_rows;
    const auto columns = static_cast<std::size_t>(x_end - x_begin);
    const auto channels = static_cast<std::size_t>(spec.nchannels);
    std::vector<T> strip(columns * channels * static_cast<std::size_t>(std::min(rows, spec.height)));

    for (int y = down(crop.y, rows); y < crop.y + crop.height; y += rows) {
        const int y_end = std::min(y + rows, spec.height);
        const bool read =
            tiled ? input.read_tiles(0, 0, spec.x + x_begin, spec.x + x_end, spec.y + y, spec.y + y_end,
                                     spec.z, spec.z + 1, 0, spec.nchannels, format, strip.data())
                  : input.read_scanlines(0, 0, spec.y + y, spec.y + y_end, spec.z, 0, spec.nchannels, format,
                                         strip.data());
        if (!read)
            throw InputError(asked, message_of(input, "its pixels cannot be decoded"), use_a_complete_file);
        for (int row = std::max(y, crop.y); row < std::min(y_end, crop.y + crop.height); ++row) {
            const std::size_t from =
                (static_cast<std::size_t>(row - y) * columns + static_cast<std::size_t>(crop.x - x_begin)) *
                channels;
            const auto width = static_cast<std::size_t>(crop.width);
            for (const Sink& sink : sinks) {
                take_channel(strip.data() + from + sink.channel, channels,
                             sink.values.subspan(static_cast<std::size_t>(row - crop.y) * width, width));
            }
        }
    }
}

/// Type, planes and alpha of the crop; alpha stands beside the planes.
Picture read_crop(OIIO::ImageInput& input, const OIIO::ImageSpec& spec, PictureFormat format, Crop crop,
                  const std::string& asked) {
    Picture picture;
    picture.type = type_of(spec);
    const int alpha = spec.nchannels > 1 ? spec.alpha_channel : -1;
    std::vector<int> planes;
    for (int c = 0; c < spec.nchannels; ++c) {
        if (c != alpha) planes.push_back(c);
    }
    try {
        picture.image = Image({crop.height, crop.width}, static_cast<int>(planes.size()),
                              space_of(spec, format, picture.type, planes));
        std::vector<Sink> sinks;
        for (std::size_t p = 0; p < planes.size(); ++p) {
            sinks.push_back({planes[p], picture.image.plane(static_cast<int>(p))});
        }
        if (alpha >= 0) {
            picture.alpha.resize(area(picture.image.size()));
            sinks.push_back({alpha, picture.alpha});
        }
        switch (picture.type) {
            case PixelType::uint8:
                read_rows<unsigned char>(input, spec, crop, sinks, asked);
                break;
            case PixelType::uint16:
                read_rows<unsigned short>(input, spec, crop, sinks, asked);
                break;
            default:
                read_rows<float>(input, spec, crop, sinks, asked);
        }
    } catch (const std::bad_alloc&) {
        throw InputError(asked,
                         compact_text_of(crop) + " pixels of " + std::to_string(spec.nchannels) +
                             " channels do not fit in memory",
                         "crop the picture");
    }
    return picture;
}

}  // namespace

Picture decode_picture(const std::filesystem::path& path, PictureFormat format,
                       const std::optional<Crop>& crop, std::uintmax_t file_bytes, const std::string& asked) {
    OIIO::ImageSpec config;
    std::string frame;
    std::optional<OIIO::Filesystem::IOMemReader> memory;
    if (format == PictureFormat::png) {
        frame = checked_png(path, asked);
        memory.emplace(frame.data(), frame.size());
        OIIO::Filesystem::IOProxy* proxy = &*memory;
        config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    }
    if (format == PictureFormat::jpeg) {
        const std::string missing = jpeg_missing_end(path);
        if (!missing.empty()) throw InputError(asked, missing, use_a_complete_file);
    }
    config.attribute("oiio:UnassociatedAlpha", 1);  // colours as stored, not multiplied by alpha
    const Reader input(OIIO::ImageInput::create(std::string(codec_name(format))).release());
    if (!input) throw InputError(asked, OIIO::geterror(), "install OpenImageIO with this format");
    OIIO::ImageSpec spec;
    if (!input->open(path.string(), spec, config)) {
        throw InputError(asked, message_of(*input, "its header cannot be decoded"), use_a_complete_file);
    }
    check_header(spec, format, file_bytes, asked);
    const Crop part = checked_crop(crop, {spec.height, spec.width}, asked);
    Picture picture = read_crop(*input, spec, format, part, asked);
    // Damage that the decoder could paint over is reported only here.
    if (input->has_error()) throw InputError(asked, input->geterror(), use_a_complete_file);
    return picture;
}

}  // namespace btfield::detail
