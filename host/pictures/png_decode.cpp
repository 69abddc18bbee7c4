#include "host/pictures/png_decode.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/pictures/orientation.hpp"
#include "host/pictures/picture_format.hpp"
#include "host/pictures/png_frame.hpp"
#include "host/pictures/png_state.hpp"
#include "host/pictures/unnamed_channels.hpp"

namespace btfield::detail {
namespace {

void begin_decoding(png_structp png, png_infop info, std::string_view& rest) {
    read_png_from(png, rest);
    png_read_info(png, info);
    png_set_expand(png);  // palettes to colours, 1 to 4 bits to 8, transparent values to alpha
    static_cast<void>(png_set_interlace_handling(png));
    png_read_update_info(png, info);
}

/// Rows one below the other.
struct PngRows {
    std::uint8_t* first = nullptr;
    std::size_t row_bytes = 0;
    int count = 0;
    int passes = 1;  ///< of interlaced pictures, over all of their rows
};

void decode_rows(png_structp png, png_infop /*info*/, PngRows& rows) {
    for (int pass = 0; pass < rows.passes; ++pass)
        for (int r = 0; r < rows.count; ++r)
            png_read_row(png, rows.first + static_cast<std::size_t>(r) * rows.row_bytes, nullptr);
}

/// An open PNG.
class OpenPng {
  public:
    OpenPng(std::string_view frame, const std::string& asked) : asked_(asked), rest_(frame) {
        check(png_.run(&begin_decoding, rest_));
    }

    [[nodiscard]] Size size() const {
        return {static_cast<int>(png_get_image_height(png_.state(), png_.info())),
                static_cast<int>(png_get_image_width(png_.state(), png_.info()))};
    }
    [[nodiscard]] int channels() const { return png_get_channels(png_.state(), png_.info()); }
    [[nodiscard]] bool has_alpha() const {
        return (png_get_color_type(png_.state(), png_.info()) & PNG_COLOR_MASK_ALPHA) != 0;
    }
    [[nodiscard]] bool wide() const { return png_get_bit_depth(png_.state(), png_.info()) == 16; }

    /// Values of the crop, [channel][row][column].
    void read(Crop crop, const std::vector<std::span<float>>& channels) {
        PngRows rows;
        rows.row_bytes = png_get_rowbytes(png_.state(), png_.info());
        const bool interlaced = png_get_interlace_type(png_.state(), png_.info()) != PNG_INTERLACE_NONE;
        constexpr int strip_rows = 64;
        rows.count = interlaced ? size().height : std::min(strip_rows, size().height);
        rows.passes = interlaced ? PNG_INTERLACE_ADAM7_PASSES : 1;
        std::vector<std::uint8_t> bytes(rows.row_bytes * static_cast<std::size_t>(rows.count));
        rows.first = bytes.data();
        const int end = crop.y + crop.height;
        for (int y = 0; y < end; y += rows.count) {
            if (!interlaced) rows.count = std::min(rows.count, end - y);
            check(png_.run(&decode_rows, rows));
            for (int row = std::max(y, crop.y); row < std::min(y + rows.count, end); ++row) {
                const std::uint8_t* const from =
                    rows.first + static_cast<std::size_t>(row - y) * rows.row_bytes;
                if (wide())
                    take_row<2>(from, row, crop, channels);
                else
                    take_row<1>(from, row, crop, channels);
            }
        }
    }

    /// Whether there is more behind the last row, once that was read.
    [[nodiscard]] bool goes_on() const {
        const std::string said = png_.warning();  // "Too much image data", "Extra compressed data"
        return said.find("Too much") != std::string::npos || said.find("Extra") != std::string::npos;
    }

  private:
    template <std::size_t bytes>
    static void take_row(const std::uint8_t* from, int row, Crop crop,
                         const std::vector<std::span<float>>& channels) {
        const auto width = static_cast<std::size_t>(crop.width);
        from += static_cast<std::size_t>(crop.x) * channels.size() * bytes;
        for (std::size_t c = 0; c < channels.size(); ++c) {
            const std::span<float> to =
                channels[c].subspan(static_cast<std::size_t>(row - crop.y) * width, width);
            for (std::size_t i = 0; i < width; ++i) {
                const std::uint8_t* const at = from + (i * channels.size() + c) * bytes;
                if constexpr (bytes == 2)
                    to[i] = static_cast<float>(at[0] * 256 + at[1]) / 65535.0F;
                else
                    to[i] = static_cast<float>(at[0]) / 255.0F;
            }
        }
    }

    void check(bool done) const {
        if (!done)
            throw InputError(asked_, "its pixels cannot be decoded (" + png_.message() + ")",
                             use_a_complete_file);
    }

    const std::string& asked_;
    std::string_view rest_;
    Png png_{Png::Use::read};
};

Picture read_pixels(OpenPng& file, Crop crop, const std::string& description) {
    Picture picture;
    picture.type = file.wide() ? PixelType::uint16 : PixelType::uint8;
    const int planes = file.channels() - (file.has_alpha() ? 1 : 0);
    picture.image =
        Image({crop.height, crop.width}, planes,
              planes == 3 ? said_space(description).value_or(ColourSpace::srgb) : ColourSpace::unspecified);
    std::vector<std::span<float>> channels;
    channels.reserve(static_cast<std::size_t>(file.channels()));
    for (int p = 0; p < planes; ++p) channels.push_back(picture.image.plane(p));
    if (file.has_alpha()) {
        picture.alpha.resize(area(picture.image.size()));
        channels.emplace_back(picture.alpha);
    }
    file.read(crop, channels);
    if (file.goes_on())
        picture.remarks.emplace_back("its pixel data goes on behind its last row, and the rest was ignored");
    return picture;
}

}  // namespace

Picture decode_png(const std::filesystem::path& path, const ReadOptions& options, const std::string& asked) {
    PngChunks chunks;
    const std::string frame = checked_png(path, asked, &chunks);
    OpenPng file(frame, asked);
    const Size size = file.size();
    const int channels = file.channels();
    static_cast<void>(chosen_part({{{}, compact_text_of(size) + ", " + counted(channels, "channel"), false}},
                                  options.part, asked));
    Surroundings around;
    around.meaning = meaning_of(chunks, around.remark, asked);
    around.exif = read_exif(chunks.exif);
    take_xmp(around.exif, xmp_packet(chunks.xmp));
    around.description = chunks.description;
    const Orientation orientation(around.exif.orientation);
    const Crop crop = checked_crop(options.crop, orientation.upright(size), asked);
    Picture picture;
    try {
        picture = read_pixels(file, orientation.stored(crop, size), around.description);
    } catch (const std::bad_alloc&) {
        throw InputError(
            asked,
            compact_text_of(crop) + " pixels of " + counted(channels, "channel") + " do not fit in memory",
            "crop the picture");
    }
    understand_unnamed(picture, channels, file.has_alpha() ? channels - 1 : -1, around, options, asked);
    if (!chunks.damaged.empty())
        picture.remarks.push_back("what its " + chunks.damaged +
                                  " says is damaged or out of place and was ignored");
    if (chunks.behind_end > 0)
        picture.remarks.push_back(counted(chunks.behind_end, "byte") +
                                  (chunks.behind_end == 1 ? " lies" : " lie") +
                                  " behind its end mark and belong to no picture");
    if (chunks.animated) picture.remarks.emplace_back("it is animated, and its first picture is read");
    return picture;
}

}  // namespace btfield::detail
