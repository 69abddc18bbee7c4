#include "host/pictures/png_encode.hpp"

#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <memory>
#include <span>
#include <system_error>
#include <vector>

#include "btfield/error.hpp"
#include "host/pictures/picture_description.hpp"
#include "host/pictures/pixel_values.hpp"
#include "host/pictures/png_state.hpp"

namespace btfield::detail {
namespace {

struct PngFile {
    std::FILE* file = nullptr;  ///< null: bytes are counted only
    int code = 0;               ///< of the first failure
    std::size_t bytes = 0;
};

void put_to_file(png_structp png, png_bytep from, std::size_t count) {
    auto& to = *static_cast<PngFile*>(png_get_io_ptr(png));
    to.bytes += count;
    if (to.file == nullptr || std::fwrite(from, 1, count, to.file) == count) return;
    to.code = errno;
    png_error(png, "the file cannot be written");
}

struct PngWork {
    PngFile to;
    const Image* image = nullptr;
    int first = 0, rows = 0;  ///< of the image
    bool wide = false;        ///< 16 bits
    int level = 0, strategy = Z_DEFAULT_STRATEGY, filters = PNG_ALL_FILTERS;
    png_charp description = nullptr;  ///< or none
    std::uint8_t* row = nullptr;
};

/// Rows as PNG has them: interleaved, 16 bits with the high byte first.
void put_row(const PngWork& work, int row) {
    const auto planes = static_cast<std::size_t>(work.image->planes());
    const auto width = static_cast<std::size_t>(work.image->width());
    for (std::size_t p = 0; p < planes; ++p) {
        const auto values =
            work.image->plane(static_cast<int>(p)).subspan(static_cast<std::size_t>(row) * width, width);
        for (std::size_t i = 0; i < width; ++i) {
            if (work.wide) {
                const auto value = to_integer<std::uint16_t>(values[i]);
                work.row[2 * (i * planes + p)] = static_cast<std::uint8_t>(value >> 8U);
                work.row[2 * (i * planes + p) + 1] = static_cast<std::uint8_t>(value);
            } else {
                work.row[i * planes + p] = to_integer<std::uint8_t>(values[i]);
            }
        }
    }
}

void write_picture_png(png_structp png, png_infop info, PngWork& work) {
    const Image& image = *work.image;
    const bool colour = image.planes() == 3;
    png_set_write_fn(png, &work.to, &put_to_file, [](png_structp) {});
    png_set_compression_buffer_size(png, std::size_t{1} << 16U);
    png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    png_set_compression_level(png, work.level);
    png_set_compression_strategy(png, work.strategy);
    png_set_IHDR(png, info, static_cast<png_uint_32>(image.width()), static_cast<png_uint_32>(work.rows),
                 work.wide ? 16 : 8, colour ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, work.filters);
    if (colour && image.space() == ColourSpace::srgb)
        png_set_sRGB_gAMA_and_cHRM(png, info, PNG_sRGB_INTENT_ABSOLUTE);
    if (colour && image.space() == ColourSpace::linear) png_set_gAMA_fixed(png, info, PNG_FP_1);
    if (work.description != nullptr) {
        png_text text{};
        char key[] = "Description";
        text.compression = PNG_TEXT_COMPRESSION_NONE;
        text.key = key;
        text.text = work.description;
        png_set_text(png, info, &text, 1);
    }
    png_write_info(png, info);
    for (int row = work.first; row < work.first + work.rows; ++row) {
        put_row(work, row);
        png_write_row(png, work.row);
    }
    png_write_end(png, nullptr);
}

/// What filters leave of most texture is noise: matches other than runs cost time and gain nothing, and the
/// mean of two neighbours leaves as little as the best of all filters, row by row (docs/performance.md).
void take_runs(PngWork& work) {
    work.level = 1;
    work.strategy = Z_RLE;
    work.filters = PNG_FILTER_AVG;
}

/// Where few colours come again and again, as in pictures whose planes nearly agree, matches count.
void take_matches(PngWork& work) {
    work.level = 2;
    work.strategy = Z_DEFAULT_STRATEGY;
    work.filters = PNG_ALL_FILTERS;
}

/// Bytes of some rows; all there are where that fails.
std::size_t bytes_of_rows(PngWork work) {
    work.to = {};
    work.description = nullptr;
    Png png(Png::Use::write);
    return png.run(&write_picture_png, work) ? work.to.bytes : std::numeric_limits<std::size_t>::max();
}

/// The faster way, unless the other is smaller by more than a twentieth in rows from the middle.
void take_better(PngWork& work) {
    constexpr int sampled = 16;
    PngWork sample = work;
    sample.rows = std::min(work.rows, sampled);
    sample.first = (work.rows - sample.rows) / 2;
    take_matches(sample);
    const std::size_t matches = bytes_of_rows(sample);
    take_runs(sample);
    const std::size_t runs = bytes_of_rows(sample);
    if (matches < runs - runs / 20)
        take_matches(work);
    else
        take_runs(work);
}

}  // namespace

void encode_png(const std::filesystem::path& path, const Image& image, const Storage& storage,
                const std::string& asked) {
    const auto fail = [&](int code) {
        throw InputError(asked, std::generic_category().message(code),
                         "free some space or choose another place");
    };
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "wb"), &std::fclose);
    if (!file) fail(errno);
    const bool wide = storage.type == PixelType::uint16;
    std::string description = description_of(image, storage, {});
    std::vector<std::uint8_t> row(static_cast<std::size_t>(image.width()) *
                                  static_cast<std::size_t>(image.planes()) * (wide ? 2 : 1));
    PngWork work;
    work.to.file = file.get();
    work.image = &image;
    work.wide = wide;
    work.level = storage.compression.value_or(1);
    work.row = row.data();
    work.rows = image.height();
    if (work.level == 0) work.filters = PNG_NO_FILTERS;
    if (work.level == 1) take_better(work);
    if (!description.empty()) work.description = description.data();
    Png png(Png::Use::write);
    const bool written = png.run(&write_picture_png, work);
    if (work.to.code != 0) fail(work.to.code);
    if (!written)
        throw InputError(asked, "it cannot be encoded (" + png.message() + ")",
                         "choose another format or size");
    if (std::fclose(file.release()) != 0) fail(errno);
}

}  // namespace btfield::detail
