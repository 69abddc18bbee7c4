#include "host/pictures/oiio/jpeg_decode.hpp"

#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include <jpeglib.h>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/pictures/picture_format.hpp"

namespace btfield::detail {
namespace {

/// Pieces of a profile, by number from 1 on.
std::string joined(const std::map<int, std::string>& pieces, int count) {
    std::string all;
    for (int i = 1; i <= count; ++i) {
        const auto piece = pieces.find(i);
        if (piece == pieces.end()) return {};
        all += piece->second;
    }
    return all;
}

class MarkerReader {
  public:
    explicit MarkerReader(std::string data) : data_(std::move(data)) {}

    JpegMarkers read() {
        std::size_t at = 2;
        bool in_scan = false;
        while (at + 1 < data_.size()) {
            if (byte(at) != 0xFF || byte(at + 1) == 0xFF) {  // entropy-coded data, or fill before a marker
                ++at;
                continue;
            }
            const int marker = byte(at + 1);
            at += 2;
            if (marker == 0xD9) {
                markers_.profile = joined(profile_, pieces_);
                return markers_;
            }
            // 0x00 escapes a data byte of 0xFF; restart marks (and 0x01) stand alone.
            if (marker <= 0x01 || (marker >= 0xD0 && marker <= 0xD7)) continue;
            if (at + 1 >= data_.size()) break;
            in_scan = in_scan || marker == 0xDA;
            const auto length = static_cast<std::size_t>(byte(at) << 8 | byte(at + 1));
            if (length >= 2 && at + length <= data_.size())
                take(marker, std::string_view(data_).substr(at + 2, length - 2));
            at += length;
        }
        markers_.missing_end = in_scan ? "it ends inside its pixel data" : "it ends inside its header";
        return markers_;
    }

  private:
    [[nodiscard]] int byte(std::size_t i) const { return static_cast<unsigned char>(data_[i]); }

    void take(int marker, std::string_view content) {
        using namespace std::string_view_literals;
        constexpr auto exif = "Exif\0\0"sv;
        constexpr auto icc = "ICC_PROFILE\0"sv;
        const bool frame =
            marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
        if (frame && content.size() > 5) markers_.components = static_cast<unsigned char>(content[5]);
        if (marker == 0xE1 && content.starts_with(exif) && markers_.exif.empty())
            markers_.exif = content.substr(exif.size());
        if (marker == 0xEE && content.starts_with("Adobe")) markers_.adobe = true;
        if (marker == 0xE2 && content.starts_with(icc) && content.size() > icc.size() + 2) {
            pieces_ = static_cast<unsigned char>(content[icc.size() + 1]);
            profile_[static_cast<unsigned char>(content[icc.size()])] = content.substr(icc.size() + 2);
        }
    }

    std::string data_;
    JpegMarkers markers_;
    std::map<int, std::string> profile_;
    int pieces_ = 0;
};

/// libjpeg's state. What fails in libjpeg leaves by longjmp() to the step that is run, which holds no object
/// with a destructor.
struct JpegState {
    jpeg_decompress_struct codec{};
    jpeg_error_mgr errors{};
    std::jmp_buf back{};
    char message[JMSG_LENGTH_MAX]{};
    bool opened = false;
    JSAMPROW rows = nullptr;  ///< of the whole picture
};

void leave(j_common_ptr codec) {
    auto& state = *static_cast<JpegState*>(codec->client_data);
    codec->err->format_message(codec, state.message);
    std::longjmp(state.back, 1);
}

/// A warning is of damage: libjpeg goes on with what it makes up.
void emit(j_common_ptr codec, int level) {
    if (level < 0) leave(codec);
}

bool read_header(JpegState& state, std::FILE* file) {
    state.codec.err = jpeg_std_error(&state.errors);
    state.errors.error_exit = &leave;
    state.errors.emit_message = &emit;
    state.codec.client_data = &state;
    if (setjmp(state.back) != 0) return false;
    jpeg_create_decompress(&state.codec);
    state.opened = true;
    jpeg_stdio_src(&state.codec, file);
    jpeg_read_header(&state.codec, TRUE);
    return true;
}

bool read_all_rows(JpegState& state) {
    if (setjmp(state.back) != 0) return false;
    state.codec.out_color_space = JCS_CMYK;
    jpeg_start_decompress(&state.codec);
    JSAMPROW row = state.rows;
    while (state.codec.output_scanline < state.codec.output_height) {
        jpeg_read_scanlines(&state.codec, &row, 1);
        row += static_cast<std::size_t>(state.codec.output_width) * 4;
    }
    jpeg_finish_decompress(&state.codec);
    return true;
}

/// An open JPEG of four components.
class InkFile {
  public:
    InkFile(const std::filesystem::path& path, const std::string& asked)
        : asked_(asked),
          file_(std::fopen(path.c_str(), "rbe"), &std::fclose),
          state_(std::make_unique<JpegState>()) {
        if (!file_ || !read_header(*state_, file_.get())) refuse();
    }
    ~InkFile() {
        if (state_->opened) jpeg_destroy_decompress(&state_->codec);
    }
    InkFile(const InkFile&) = delete;
    InkFile& operator=(const InkFile&) = delete;

    [[nodiscard]] Size size() const {
        return {static_cast<int>(state_->codec.image_height), static_cast<int>(state_->codec.image_width)};
    }
    [[nodiscard]] std::vector<JSAMPLE> inks() {
        std::vector<JSAMPLE> values(area(size()) * 4);
        state_->rows = values.data();
        if (!read_all_rows(*state_)) refuse();
        return values;
    }

  private:
    [[noreturn]] void refuse() const {
        const std::string why = valid_utf8(state_->message);
        const bool unknown =
            why.find("nsupported") != std::string::npos || why.find("not supported") != std::string::npos;
        throw InputError(
            asked_,
            unknown ? "it is of a kind that is not supported (" + why + ")" : "it is damaged (" + why + ")",
            unknown ? convert_it : use_a_complete_file);
    }
    const std::string& asked_;
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
    std::unique_ptr<JpegState> state_;
};

}  // namespace

JpegMarkers jpeg_markers(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return MarkerReader({std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()}).read();
}

Size size_of_inks(const std::filesystem::path& path, const std::string& asked) {
    return InkFile(path, asked).size();
}

Image decode_inks(const std::filesystem::path& path, const std::optional<Crop>& crop,
                  const JpegMarkers& markers, const std::string& asked) {
    InkFile file(path, asked);
    const Size size = file.size();
    const Crop part = checked_crop(crop, size, asked);
    const std::vector<JSAMPLE> values = file.inks();
    Image image({part.height, part.width}, 4);
    for (int row = 0; row < part.height; ++row)
        for (int column = 0; column < part.width; ++column)
            for (int p = 0; p < 4; ++p) {
                const std::size_t at =
                    (static_cast<std::size_t>(part.y + row) * static_cast<std::size_t>(size.width) +
                     static_cast<std::size_t>(part.x + column)) *
                        4 +
                    static_cast<std::size_t>(p);
                const float value = static_cast<float>(values[at]) / 255.0F;
                image.at(p, row, column) = markers.adobe ? 1.0F - value : value;
            }
    return image;
}

}  // namespace btfield::detail
