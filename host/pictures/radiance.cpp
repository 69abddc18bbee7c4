#include "host/pictures/radiance.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/pictures/channels.hpp"
#include "host/pictures/colour.hpp"
#include "host/pictures/orientation.hpp"

namespace btfield::detail {
namespace {

using Pixel = std::array<std::uint8_t, 4>;

struct RadianceHeader {
    bool xyz = false;
    double exposure = 1.0, gamma = 1.0, aspect = 1.0;
    std::array<double, 3> correction{1.0, 1.0, 1.0};
    std::optional<Chromaticities> primaries;
    Size stored;             ///< scanlines × pixels of each
    int orientation = 1;     ///< as Orientation has it
    std::string axes;        ///< "-Y+X" of most
    std::size_t pixels = 0;  ///< where they begin
};

/// Numbers with blanks between them; those that there are.
std::vector<double> numbers_of(std::string_view text) {
    std::vector<double> numbers;
    while (!text.empty()) {
        const std::size_t start = text.find_first_not_of(" \t\r+");
        if (start == std::string_view::npos) break;
        text.remove_prefix(start);
        double number = 0.0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
        if (error != std::errc() || !std::isfinite(number)) break;
        numbers.push_back(number);
        text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    }
    return numbers;
}

class HeaderReader {
  public:
    HeaderReader(std::string_view bytes, const std::string& asked) : bytes_(bytes), asked_(asked) {}

    RadianceHeader read() {
        bool known = false;
        for (std::string_view line = next(); !line.empty(); line = next()) {
            const std::size_t equals = line.find('=');
            if (line.front() == '#' || equals == std::string_view::npos) continue;
            take(line.substr(0, equals), line.substr(equals + 1), known);
        }
        resolution(next());
        header_.pixels = at_;
        return header_;
    }

  private:
    [[noreturn]] void refuse(const std::string& found, const char* remedy = use_a_complete_file) const {
        throw InputError(asked_, found, remedy);
    }

    std::string_view next() {
        const std::size_t end = bytes_.find('\n', at_);
        if (end == std::string_view::npos) refuse("it ends inside its header");
        std::string_view line = bytes_.substr(at_, end - at_);
        at_ = end + 1;
        if (line.ends_with('\r')) line.remove_suffix(1);
        return line;
    }

    void take(std::string_view key, std::string_view text, bool& known) {
        while (key.ends_with(' ')) key.remove_suffix(1);
        const std::vector<double> numbers = numbers_of(text);
        const auto positive = [&](std::size_t count) {
            if (numbers.size() < count ||
                !std::all_of(numbers.begin(), numbers.end(), [](double v) { return v > 0.0; }))
                refuse("its " + std::string(key) + " is not " +
                       (count == 1 ? "a number above 0" : "three numbers above 0"));
        };
        if (key == "FORMAT") {
            while (text.starts_with(' ')) text.remove_prefix(1);
            header_.xyz = text == "32-bit_rle_xyze";
            known = header_.xyz || text == "32-bit_rle_rgbe";
            if (!known)
                refuse("its pixels are '" + valid_utf8(text.substr(0, 40)) + "', which is not supported",
                       convert_it);
        } else if (key == "EXPOSURE") {
            positive(1);
            header_.exposure *= numbers[0];  // every program adds a line
        } else if (key == "GAMMA") {
            positive(1);
            header_.gamma = numbers[0];
        } else if (key == "PIXASPECT") {
            positive(1);
            header_.aspect *= numbers[0];
        } else if (key == "COLORCORR") {
            positive(3);
            for (std::size_t i = 0; i < 3; ++i) header_.correction[i] *= numbers[i];
        } else if (key == "PRIMARIES") {
            if (numbers.size() < 8) refuse("its PRIMARIES are not eight numbers");
            std::copy_n(numbers.begin(), 8, header_.primaries.emplace().begin());
        }
    }

    /// "-Y 480 +X 640" and its seven siblings.
    void resolution(std::string_view line) {
        const std::vector<double> first = numbers_of(line.substr(std::min<std::size_t>(line.size(), 2)));
        const std::size_t space = line.find(' ', 3);
        const bool long_enough =
            line.size() > 6 && space != std::string_view::npos && space + 3 < line.size();
        if (!long_enough) refuse("its header does not end in a size");
        const std::string_view second = line.substr(space + 1);
        const std::vector<double> other = numbers_of(second.substr(2));
        constexpr double most = 2147483647.0;
        const bool sides = !first.empty() && !other.empty() && first[0] >= 1.0 && other[0] >= 1.0 &&
                           first[0] <= most && other[0] <= most;
        const std::string axes{line[0], line[1], second[0], second[1]};
        // The first axis is that of scanlines; X grows to the right, Y upwards.
        constexpr std::array<std::pair<std::string_view, int>, 8> known{{{"-Y+X", 1},
                                                                         {"-Y-X", 2},
                                                                         {"+Y-X", 3},
                                                                         {"+Y+X", 4},
                                                                         {"+X-Y", 5},
                                                                         {"-X-Y", 6},
                                                                         {"-X+Y", 7},
                                                                         {"+X+Y", 8}}};
        for (const auto& [text, orientation] : known)
            if (text == axes && sides) {
                header_.orientation = orientation;
                header_.axes = axes;
                header_.stored = {static_cast<int>(first[0]), static_cast<int>(other[0])};
                return;
            }
        refuse("its header does not end in a size");
    }

    std::string_view bytes_;
    const std::string& asked_;
    std::size_t at_ = 0;
    RadianceHeader header_;
};

/// Scanlines out of their run lengths.
class ScanlineReader {
  public:
    ScanlineReader(std::string_view bytes, const std::string& asked) : bytes_(bytes), asked_(asked) {}

    void read(std::vector<Pixel>& line) {
        const std::size_t width = line.size();
        const bool coded = width >= 8 && width <= 32767 && bytes_.size() - at_ >= 4 && peek(0) == 2 &&
                           peek(1) == 2 && peek(2) < 128;
        if (!coded) return read_old(line);
        if ((static_cast<std::size_t>(peek(2)) << 8 | peek(3)) != width)
            throw InputError(asked_, "one of its rows has another length", use_a_complete_file);
        at_ += 4;
        for (std::size_t channel = 0; channel < 4; ++channel) {
            for (std::size_t i = 0; i < width;) {
                const std::size_t count = byte();
                const bool run = count > 128;
                const std::size_t length = run ? count - 128 : count;
                if (length == 0 || length > width - i)
                    throw InputError(asked_, "a run of its pixels is damaged", use_a_complete_file);
                const std::uint8_t value = run ? byte() : std::uint8_t{0};
                for (std::size_t k = 0; k < length; ++k) line[i++][channel] = run ? value : byte();
            }
        }
    }

  private:
    /// Pixels as they are, or repeated by those of mantissas 1, 1, 1.
    void read_old(std::vector<Pixel>& line) {
        unsigned shift = 0;
        for (std::size_t i = 0; i < line.size();) {
            Pixel pixel{};
            for (std::uint8_t& value : pixel) value = byte();
            if (pixel[0] != 1 || pixel[1] != 1 || pixel[2] != 1 || i == 0) {
                line[i++] = pixel;
                shift = 0;
                continue;
            }
            std::size_t count = shift < 32 ? static_cast<std::size_t>(pixel[3]) << shift : line.size();
            for (; count > 0 && i < line.size(); --count, ++i) line[i] = line[i - 1];
            shift += 8;
        }
    }
    [[nodiscard]] std::uint8_t peek(std::size_t ahead) const {
        return static_cast<std::uint8_t>(bytes_[at_ + ahead]);
    }
    std::uint8_t byte() {
        if (at_ >= bytes_.size())
            throw InputError(asked_, "it ends inside its pixel data", use_a_complete_file);
        return static_cast<std::uint8_t>(bytes_[at_++]);
    }
    std::string_view bytes_;
    const std::string& asked_;
    std::size_t at_ = 0;
};

/// Values become linear Rec. 709, or XYZ; keep_values leaves gamma and primaries.
void understand(const RadianceHeader& header, bool keep_values, Picture& picture) {
    Image& image = picture.image;
    if (header.aspect != 1.0)
        picture.remarks.emplace_back("its pixels are not square, and are taken as square");
    if (!keep_values && header.gamma != 1.0) {
        for (float& value : image.values())
            value = static_cast<float>(std::pow(static_cast<double>(value), header.gamma));
        picture.remarks.emplace_back("its GAMMA was undone");
    }
    bool divided = false;
    for (std::size_t p = 0; p < 3; ++p) {
        const double factor = header.exposure * header.correction[p];
        divided = divided || factor != 1.0;
        if (factor == 1.0 || keep_values) continue;
        for (float& value : image.plane(static_cast<int>(p)))
            value = static_cast<float>(static_cast<double>(value) / factor);
    }
    if (divided && !keep_values)
        picture.remarks.emplace_back("values were divided by its EXPOSURE or COLORCORR");
    const bool other = !header.xyz && header.primaries && !same_primaries(*header.primaries, rec709, 4e-3);
    if (keep_values && (divided || header.gamma != 1.0)) image.set_space(ColourSpace::unspecified);
    if (!other) return;
    const std::optional<Matrix3> matrix = rec709_from(*header.primaries);
    if (!matrix) {
        picture.remarks.emplace_back("its PRIMARIES span no colours, and Rec. 709 is assumed");
        return;
    }
    picture.chromaticities = header.primaries;
    if (keep_values) {
        image.set_space(ColourSpace::unspecified);
        return;
    }
    transform(image, *matrix);
    picture.remarks.emplace_back("its primaries are not Rec. 709, and its colours were converted");
}

Pixel shared_exponent(std::array<float, 3> value) {
    for (float& v : value) v = std::max(v, 0.0F);
    const float largest = std::max({value[0], value[1], value[2]});
    if (largest < 1e-32F) return {0, 0, 0, 0};
    int exponent = 0;
    const double mantissa = std::frexp(static_cast<double>(largest), &exponent);
    // Rounded, a mantissa may need the next exponent.
    if (std::lround(mantissa * 256.0) > 255) ++exponent;
    const double scale = std::ldexp(1.0, 8 - exponent);
    Pixel pixel{};
    for (std::size_t i = 0; i < 3; ++i)
        pixel[i] = static_cast<std::uint8_t>(
            std::clamp(std::lround(static_cast<double>(value[i]) * scale), 0L, 255L));
    pixel[3] = static_cast<std::uint8_t>(exponent + 128);
    return pixel;
}

/// One channel of a row: runs of at least four, what lies between as it is.
void append_runs(const std::vector<Pixel>& line, std::size_t channel, std::string& to) {
    const std::size_t width = line.size();
    const auto run_at = [&](std::size_t i) {
        std::size_t length = 1;
        while (i + length < width && length < 127 && line[i + length][channel] == line[i][channel]) ++length;
        return length;
    };
    for (std::size_t i = 0; i < width;) {
        const std::size_t run = run_at(i);
        if (run >= 4) {
            to += static_cast<char>(128 + run);
            to += static_cast<char>(line[i][channel]);
            i += run;
            continue;
        }
        std::size_t end = i;
        while (end < width && end - i < 128 && run_at(end) < 4) ++end;
        to += static_cast<char>(end - i);
        for (; i < end; ++i) to += static_cast<char>(line[i][channel]);
    }
}

}  // namespace

Picture read_radiance(const std::filesystem::path& path, const ReadOptions& options,
                      std::uintmax_t file_bytes, const std::string& asked) {
    const std::string bytes = file_content(path);
    const RadianceHeader header = HeaderReader(bytes, asked).read();
    static_cast<void>(chosen_part({{{}, compact_text_of(header.stored), false}}, options.part, asked));
    check_packing(header.stored, 4.0 * header.stored.width, file_bytes, asked);
    const Orientation orientation(header.orientation);
    const Crop crop = checked_crop(options.crop, orientation.upright(header.stored), asked);
    const Crop stored = orientation.stored(crop, header.stored);

    Picture picture;
    picture.type = PixelType::float32;
    picture.image =
        Image({stored.height, stored.width}, 3, header.xyz ? ColourSpace::xyz : ColourSpace::linear);
    ScanlineReader scanlines(std::string_view(bytes).substr(header.pixels), asked);
    std::vector<Pixel> line(static_cast<std::size_t>(header.stored.width));
    const auto first = static_cast<std::size_t>(stored.x);
    for (int row = 0; row < header.stored.height; ++row) {
        scanlines.read(line);  // all of them: damage outside of a crop is damage
        if (row < stored.y || row >= stored.y + stored.height) continue;
        for (int column = 0; column < stored.width; ++column) {
            const Pixel& pixel = line[first + static_cast<std::size_t>(column)];
            const float scale = pixel[3] == 0 ? 0.0F : std::ldexp(1.0F, static_cast<int>(pixel[3]) - 136);
            for (int p = 0; p < 3; ++p)
                picture.image.at(p, row - stored.y, column) =
                    static_cast<float>(pixel[static_cast<std::size_t>(p)]) * scale;
        }
    }
    understand(header, options.keep_values, picture);
    make_upright(picture, orientation);
    if (!orientation.stored_upright())
        picture.remarks.push_back("it is stored " + header.axes + ", and was turned upright");
    keep_planes(picture, plan_channels(channel_names(3), options.planes, -1, asked));
    return picture;
}

void write_radiance(const std::filesystem::path& path, const Image& image, const Storage& storage,
                    const std::string& asked) {
    std::string bytes = "#?RADIANCE\nSOFTWARE=btfield\nFORMAT=32-bit_rle_rgbe\n";
    if (storage.chromaticities) {
        bytes += "PRIMARIES=";
        for (const double value : *storage.chromaticities) {
            std::array<char, 32> text{};
            const auto [end, error] =
                std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed, 6);
            bytes += ' ' + std::string(text.data(), end);
        }
        bytes += '\n';
    }
    bytes += "\n-Y " + std::to_string(image.height()) + " +X " + std::to_string(image.width()) + "\n";
    errno = 0;
    std::ofstream file(path, std::ios::binary);
    std::vector<Pixel> line(static_cast<std::size_t>(image.width()));
    const bool coded = image.width() >= 8 && image.width() <= 32767;
    for (int row = 0; row < image.height(); ++row) {
        for (int column = 0; column < image.width(); ++column)
            line[static_cast<std::size_t>(column)] = shared_exponent(
                {image.at(0, row, column), image.at(1, row, column), image.at(2, row, column)});
        if (coded) {
            bytes +=
                {'\2', '\2', static_cast<char>(image.width() >> 8), static_cast<char>(image.width() & 255)};
            for (std::size_t channel = 0; channel < 4; ++channel) append_runs(line, channel, bytes);
        } else {
            for (const Pixel& pixel : line)
                for (const std::uint8_t value : pixel) bytes += static_cast<char>(value);
        }
        file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
        bytes.clear();
    }
    file.close();
    if (!file)
        throw InputError(asked,
                         errno != 0 ? std::generic_category().message(errno) : "its pixels cannot be stored",
                         "free some space or choose another place");
}

}  // namespace btfield::detail
