#include "host/pictures/palette_png.hpp"

#include <png.h>

#include <algorithm>
#include <cstddef>
#include <new>
#include <string_view>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/pictures/picture_format.hpp"
#include "host/pictures/png_frame.hpp"
#include "host/pictures/png_state.hpp"

namespace btfield::detail {
namespace {

void read_png_header(png_structp png, png_infop info, std::string_view& rest) {
    read_png_from(png, rest);
    png_set_benign_errors(png, 0);  // a picture that is nearly right is wrong
    png_set_check_for_invalid_index(png, 0);
    png_read_info(png, info);
    png_set_packing(png);  // a byte for each pixel of fewer bits, not scaled
}

void read_png_rows(png_structp png, png_infop info, PaletteImage& to) {
    const int passes = png_set_interlace_handling(png);
    png_read_update_info(png, info);
    const auto width = static_cast<std::size_t>(to.size.width);
    if (png_get_rowbytes(png, info) != width) png_error(png, "its rows have another length");
    for (int pass = 0; pass < passes; ++pass) {
        png_bytep row = to.values.data();
        for (int r = 0; r < to.size.height; ++r, row += width) png_read_row(png, row, nullptr);
    }
    png_read_end(png, nullptr);
}

/// How many values there are and how transparent each is.
void take_palette(const Png& png, PaletteImage& to) {
    to.alpha.fill(255);
    to.colours = 256;
    png_colorp colours = nullptr;
    png_bytep alpha = nullptr;
    png_color_16p grey = nullptr;
    int count = 0;
    const bool transparent = png_get_tRNS(png.state(), png.info(), &alpha, &count, &grey) != 0;
    if (png_get_color_type(png.state(), png.info()) == PNG_COLOR_TYPE_PALETTE) {
        if (transparent) std::copy_n(alpha, std::min(count, 256), to.alpha.begin());
        png_get_PLTE(png.state(), png.info(), &colours, &to.colours);
    } else if (transparent && grey->gray < to.alpha.size()) {
        to.alpha[grey->gray] = 0;
    }
}

struct Target {
    Size size;
    const std::uint8_t* values = nullptr;
    const png_color* palette = nullptr;
    int colours = 0;
    std::string bytes;
};

bool append_bytes(std::string& to, const png_byte* from, std::size_t count) noexcept {
    try {
        to.append(reinterpret_cast<const char*>(from), count);
        return true;
    } catch (const std::bad_alloc&) {
        return false;
    }
}

void put_bytes(png_structp png, png_bytep from, std::size_t count) {
    if (!append_bytes(*static_cast<std::string*>(png_get_io_ptr(png)), from, count))
        png_error(png, "out of memory");
}

void write_png(png_structp png, png_infop info, Target& target) {
    png_set_write_fn(png, &target.bytes, &put_bytes, [](png_structp) {});
    png_set_IHDR(png, info, static_cast<png_uint_32>(target.size.width),
                 static_cast<png_uint_32>(target.size.height), 8, PNG_COLOR_TYPE_PALETTE, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_PLTE(png, info, target.palette, target.colours);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_NONE);
    png_write_info(png, info);
    const std::uint8_t* row = target.values;
    for (int r = 0; r < target.size.height; ++r, row += target.size.width) png_write_row(png, row);
    png_write_end(png, nullptr);
}

}  // namespace

std::optional<PaletteImage> decode_palette_png(const std::filesystem::path& path, const std::string& asked) {
    const std::string frame = checked_png(path, asked);
    constexpr std::size_t depth_at = 24;
    constexpr std::size_t colour_at = 25;
    const char colour = frame[colour_at];
    if (frame[depth_at] > 8 || (colour != PNG_COLOR_TYPE_PALETTE && colour != PNG_COLOR_TYPE_GRAY)) return {};

    Png png(Png::Use::read);
    const auto check = [&](bool done) {
        if (!done)
            throw InputError(asked, "it cannot be decoded (" + png.message() + ")", use_a_complete_file);
    };
    std::string_view rest = frame;
    check(png.run(&read_png_header, rest));
    PaletteImage image;
    image.size = {static_cast<int>(png_get_image_height(png.state(), png.info())),
                  static_cast<int>(png_get_image_width(png.state(), png.info()))};
    try {
        image.values.resize(area(image.size));
    } catch (const std::bad_alloc&) {
        throw InputError(asked, compact_text_of(image.size) + " pixels do not fit in memory",
                         "give a smaller picture");
    }
    take_palette(png, image);
    check(png.run(&read_png_rows, image));
    return image;
}

std::string encode_palette_png(Size size, std::span<const std::uint8_t> values,
                               std::span<const std::array<std::uint8_t, 3>> palette,
                               const std::string& asked) {
    constexpr int most = most_png_pixels;
    if (size.width > most || size.height > most) {
        throw InputError(asked, compact_text_of(size) + " pixels are too many for a PNG",
                         "use at most " + std::to_string(most) + " on a side");
    }
    std::vector<png_color> colours;
    colours.reserve(palette.size());
    for (const auto& [red, green, blue] : palette) colours.push_back({red, green, blue});
    Target target{size, values.data(), colours.data(), static_cast<int>(colours.size()), {}};
    Png png(Png::Use::write);
    if (!png.run(&write_png, target)) {
        throw InputError(asked, "it cannot be encoded (" + png.message() + ")", "use a smaller field");
    }
    return std::move(target.bytes);
}

}  // namespace btfield::detail
