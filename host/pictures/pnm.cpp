#include "host/pictures/pnm.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <string_view>
#include <system_error>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/pictures/channels.hpp"
#include "host/pictures/picture_format.hpp"
#include "host/pictures/pixel_values.hpp"

namespace btfield::detail {
namespace {

bool is_space(char c) {
    return c == ' ' || (c >= '\t' && c <= '\r');
}

/// Text part of a file: numbers between white space and comments.
class Scanner {
  public:
    Scanner(std::string_view text, const std::string& asked) : text_(text), asked_(asked) {}

    int number(const char* what) {
        skip();
        int value = 0;
        const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
        if (error != std::errc() || value < 0) fail(what);
        at_ = static_cast<std::size_t>(end - text_.data());
        return value;
    }
    /// P1 may leave out the space between its digits.
    int digit(const char* what) {
        skip();
        if (at_ >= text_.size() || (text_[at_] != '0' && text_[at_] != '1')) fail(what);
        return text_[at_++] - '0';
    }
    /// Raw data begins behind one character of white space.
    std::string_view rest() {
        if (at_ >= text_.size() || !is_space(text_[at_])) fail("its pixel data");
        return text_.substr(at_ + 1);
    }

  private:
    void skip() {
        while (at_ < text_.size() && (is_space(text_[at_]) || text_[at_] == '#')) {
            if (text_[at_] == '#') at_ = std::min(text_.find('\n', at_), text_.size() - 1);
            ++at_;
        }
    }
    [[noreturn]] void fail(const char* what) const {
        throw InputError(asked_,
                         at_ >= text_.size() ? "it ends inside " + std::string(what)
                                             : std::string(what) + " is not a number that belongs there",
                         use_a_complete_file);
    }
    std::string_view text_;
    const std::string& asked_;
    std::size_t at_ = 2;
};

/// Values of the crop, raw as they stand in the file.
struct Samples {
    int planes = 1;
    int maximum = 1;
    Size size;
    std::vector<std::uint16_t> values;  ///< [row][column][plane] of the crop
};

/// P1, P4: bits. P4, P5, P6: raw.
struct Kind {
    explicit Kind(char digit)
        : bitmap(digit == '1' || digit == '4'),
          raw(digit >= '4'),
          planes(digit == '3' || digit == '6' ? 3 : 1) {}
    bool bitmap, raw;
    int planes;
};

Samples decode_header(Scanner& scanner, Kind kind, const std::string& asked) {
    Samples samples;
    samples.planes = kind.planes;
    samples.size.width = scanner.number("its width");
    samples.size.height = scanner.number("its height");
    samples.maximum = kind.bitmap ? 1 : scanner.number("its maximum");
    if (samples.size.width < 1 || samples.size.height < 1) {
        throw InputError(asked, "its header says that there are no pixels", use_a_complete_file);
    }
    if (samples.maximum < 1 || samples.maximum > 65535) {
        throw InputError(asked, "its maximum is " + std::to_string(samples.maximum),
                         "give a file with 1 to 65535");
    }
    return samples;
}

/// Value i of a raw row.
int raw_value(const char* row, std::size_t i, Kind kind, std::size_t value_bytes) {
    const auto byte = [&](std::size_t k) { return static_cast<int>(static_cast<unsigned char>(row[k])); };
    if (kind.bitmap) return byte(i / 8) >> (7 - i % 8) & 1;
    return value_bytes == 1 ? byte(i) : byte(2 * i) * 256 + byte(2 * i + 1);
}

/// Bytes of a row that is raw.
std::size_t raw_row_bytes(const Samples& header, Kind kind) {
    const std::size_t values =
        static_cast<std::size_t>(header.size.width) * static_cast<std::size_t>(header.planes);
    if (kind.bitmap) return (values + 7) / 8;
    return header.maximum > 255 ? 2 * values : values;
}

/// Raw pictures may stand in a row; in text there is one.
struct Sequence {
    std::vector<std::string_view> pictures;  ///< each from its first byte to the end of the file
    std::vector<Part> parts;
};

Sequence pictures_in(std::string_view bytes, const std::string& asked) {
    Sequence result;
    for (bool more = true; more;) {
        const Kind kind(bytes[1]);
        Scanner scanner(bytes, asked);
        const Samples header = decode_header(scanner, kind, asked);
        result.pictures.push_back(bytes);
        result.parts.push_back({{}, compact_text_of(header.size), false});
        if (!kind.raw) return result;
        const std::string_view pixels = scanner.rest();
        const std::size_t row_bytes = raw_row_bytes(header, kind);
        const auto rows = static_cast<std::size_t>(header.size.height);
        if (row_bytes > pixels.size() / rows) return result;
        bytes = pixels.substr(row_bytes * rows);
        more = format_of_bytes(bytes.substr(0, 3)) == PictureFormat::pnm;
    }
    return result;
}

Samples decode(std::string_view bytes, const std::optional<Crop>& asked_crop, Crop& crop,
               const std::string& asked) {
    const Kind kind(bytes[1]);
    Scanner scanner(bytes, asked);
    Samples samples = decode_header(scanner, kind, asked);
    crop = checked_crop(asked_crop, samples.size, asked);

    const auto planes = static_cast<std::size_t>(samples.planes);
    const auto row_values = static_cast<std::size_t>(samples.size.width) * planes;
    const std::size_t value_bytes = samples.maximum > 255 ? 2 : 1;
    const std::size_t row_bytes = kind.raw ? raw_row_bytes(samples, kind) : row_values * value_bytes;
    const auto rows = static_cast<std::size_t>(samples.size.height);
    const std::string_view pixels = kind.raw ? scanner.rest() : bytes;
    // A value in text takes at least one byte, so this also stops a header that claims more than there is.
    if (row_bytes > pixels.size() / rows) {
        throw InputError(asked,
                         "it ends inside its pixel data: " + std::to_string(pixels.size()) + " bytes for " +
                             compact_text_of(samples.size) + " pixels",
                         use_a_complete_file);
    }

    const auto first = static_cast<std::size_t>(crop.x) * planes;
    const auto count = static_cast<std::size_t>(crop.width) * planes;
    samples.values.reserve(count * static_cast<std::size_t>(crop.height));
    for (std::size_t row = 0; row < rows; ++row) {
        const bool wanted = static_cast<int>(row) >= crop.y && static_cast<int>(row) < crop.y + crop.height;
        if (kind.raw && !wanted) continue;
        for (std::size_t i = 0; i < row_values; ++i) {
            const bool inside = wanted && i >= first && i < first + count;
            if (kind.raw && !inside) continue;
            int value = 0;
            if (kind.raw) {
                value = raw_value(pixels.data() + row * row_bytes, i, kind, value_bytes);
            } else {
                value = kind.bitmap ? scanner.digit("its pixel data") : scanner.number("its pixel data");
            }
            if (value > samples.maximum) {
                throw InputError(asked,
                                 "a value is " + std::to_string(value) + ", above its maximum of " +
                                     std::to_string(samples.maximum),
                                 use_a_complete_file);
            }
            if (inside) {
                samples.values.push_back(static_cast<std::uint16_t>(kind.bitmap ? 1 - value : value));
            }
        }
    }
    return samples;
}

template <class T>
void append_row(std::string& bytes, const Image& image, int row) {
    for (int c = 0; c < image.width(); ++c) {
        for (int p = 0; p < image.planes(); ++p) {
            const T value = to_integer<T>(image.at(p, row, c));
            if constexpr (sizeof(T) == 2) bytes.push_back(static_cast<char>(value >> 8));
            bytes.push_back(static_cast<char>(value & 0xff));
        }
    }
}

}  // namespace

int pnm_maximum(const std::filesystem::path& path, const std::string& asked) {
    const std::string bytes = file_content(path);
    Scanner scanner(bytes, asked);
    return decode_header(scanner, Kind(bytes[1]), asked).maximum;
}

Picture read_pnm(const std::filesystem::path& path, const ReadOptions& options, const std::string& asked) {
    const std::string bytes = file_content(path);
    const Sequence sequence = pictures_in(bytes, asked);
    const int chosen = chosen_part(sequence.parts, options.part, asked);
    Crop part;
    const Samples samples =
        decode(sequence.pictures[static_cast<std::size_t>(chosen)], options.crop, part, asked);

    Picture picture;
    picture.type = samples.maximum > 255 ? PixelType::uint16 : PixelType::uint8;
    picture.image = Image({part.height, part.width}, samples.planes,
                          samples.planes == 3 ? ColourSpace::srgb : ColourSpace::unspecified);
    if (samples.planes == 1) picture.image.set_plane_spaces({ColourSpace::srgb});
    const auto planes = static_cast<std::size_t>(samples.planes);
    for (std::size_t p = 0; p < planes; ++p) {
        const auto plane = picture.image.plane(static_cast<int>(p));
        for (std::size_t i = 0; i < plane.size(); ++i) {
            plane[i] =
                static_cast<float>(samples.values[i * planes + p]) / static_cast<float>(samples.maximum);
        }
    }
    keep_planes(picture, plan_channels(channel_names(samples.planes), options.planes, -1, asked));
    return picture;
}

void write_pnm(const std::filesystem::path& path, const Image& image, PixelType type,
               const std::string& asked) {
    errno = 0;
    std::ofstream file(path, std::ios::binary);
    const bool wide = type == PixelType::uint16;
    file << (image.planes() == 1 ? "P5\n" : "P6\n") << image.width() << ' ' << image.height() << '\n'
         << (wide ? 65535 : 255) << '\n';
    std::string bytes;
    for (int row = 0; row < image.height(); ++row) {
        bytes.clear();
        if (wide) {
            append_row<std::uint16_t>(bytes, image, row);
        } else {
            append_row<std::uint8_t>(bytes, image, row);
        }
        file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    }
    file.close();
    if (!file)
        throw InputError(asked,
                         errno != 0 ? std::generic_category().message(errno) : "its pixels cannot be stored",
                         "free some space or choose another place");
}

}  // namespace btfield::detail
