#include "bench/peers/png.hpp"

#include <png.h>

#include <algorithm>
#include <cstddef>

namespace btfield::peer {

std::vector<unsigned char> png_bytes(const Image& image) {
    std::vector<unsigned char> bytes;
    bytes.reserve(std::size_t{1} << 20);
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    png_set_write_fn(
        png, &bytes,
        [](png_structp from, png_bytep data, std::size_t count) {
            auto& to = *static_cast<std::vector<unsigned char>*>(png_get_io_ptr(from));
            to.insert(to.end(), data, data + count);
        },
        [](png_structp) {});
    png_set_compression_level(png, 1);
    const auto width = static_cast<png_uint_32>(image.width()),
               height = static_cast<png_uint_32>(image.height());
    png_set_IHDR(png, info, width, height, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    std::vector<unsigned char> row(std::size_t{3} * width);
    for (std::size_t r = 0; r < height; ++r) {
        for (std::size_t p = 0; p < 3; ++p) {
            const float* values = image.plane(static_cast<int>(p)).data() + r * width;
            for (std::size_t c = 0; c < width; ++c)
                row[3 * c + p] =
                    static_cast<unsigned char>(std::clamp(values[c] * 255.0F + 0.5F, 0.0F, 255.0F));
        }
        png_write_row(png, row.data());
    }
    png_write_end(png, nullptr);
    png_destroy_write_struct(&png, &info);
    return bytes;
}

}  // namespace btfield::peer
