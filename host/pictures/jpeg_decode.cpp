#include "host/pictures/jpeg_decode.hpp"

#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <string_view>
#include <vector>

#include <jpeglib.h>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/pictures/channels.hpp"
#include "host/pictures/colour_profile.hpp"
#include "host/pictures/exif.hpp"
#include "host/pictures/orientation.hpp"
#include "host/pictures/picture_format.hpp"

namespace btfield::detail {
namespace {

/// What stands around the pixels.
struct JpegMarkers {
    std::string missing_end;  ///< where the file breaks off before its end mark; empty when it is complete
    std::string profile;      ///< ICC, put together from its pieces; empty: none or damaged
    bool damaged_profile = false;
    std::string exif;    ///< from its byte order mark on; empty: none
    std::string xmp;     ///< empty: none
    bool adobe = false;  ///< written by a program of Adobe: inks are stored the other way round
};

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
                markers_.damaged_profile = (has_pieces_ && markers_.profile.empty()) || has_twins_;
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
        if (marker == 0xE1 && content.starts_with(exif) && markers_.exif.empty())
            markers_.exif = content.substr(exif.size());
        if (marker == 0xE1 && content.starts_with(jpeg_xmp_mark) && markers_.xmp.empty())
            markers_.xmp = content.substr(jpeg_xmp_mark.size());
        if (marker == 0xEE && content.starts_with("Adobe")) markers_.adobe = true;
        if (marker == 0xE2 && content.starts_with(icc)) {
            has_pieces_ = true;
            if (content.size() <= icc.size() + 2) return;
            pieces_ = static_cast<unsigned char>(content[icc.size() + 1]);
            std::string& piece = profile_[static_cast<unsigned char>(content[icc.size()])];
            has_twins_ = has_twins_ || !piece.empty();
            piece = content.substr(icc.size() + 2);
        }
    }

    std::string data_;
    JpegMarkers markers_;
    std::map<int, std::string> profile_;
    int pieces_ = 0;
    bool has_pieces_ = false, has_twins_ = false;
};

/// libjpeg's state. What fails in libjpeg leaves by longjmp() to the step that is run, which makes no object
/// with a destructor.
struct JpegState {
    JpegState() = default;
    ~JpegState() {
        if (opened) jpeg_destroy_decompress(&codec);
    }
    JpegState(const JpegState&) = delete;
    JpegState& operator=(const JpegState&) = delete;

    jpeg_decompress_struct codec{};
    jpeg_error_mgr errors{};
    std::jmp_buf back{};
    char message[JMSG_LENGTH_MAX]{};
    bool opened = false;
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

/// \param row  memory of one row, all components of a pixel beside each other
bool read_rows(JpegState& state, JSAMPLE* row, const Crop& crop, Image& image) {
    if (setjmp(state.back) != 0) return false;
    const int planes = image.planes();
    state.codec.out_color_space = planes == 4 ? JCS_CMYK : planes == 3 ? JCS_RGB : JCS_GRAYSCALE;
    jpeg_start_decompress(&state.codec);
    while (state.codec.output_scanline < state.codec.output_height) {
        const int r = static_cast<int>(state.codec.output_scanline) - crop.y;
        jpeg_read_scanlines(&state.codec, &row, 1);
        if (r < 0 || r >= crop.height) continue;
        const JSAMPLE* from = row + static_cast<std::size_t>(crop.x) * static_cast<std::size_t>(planes);
        for (int c = 0; c < crop.width; ++c)
            for (int p = 0; p < planes; ++p) image.at(p, r, c) = static_cast<float>(*from++) / 255.0F;
    }
    jpeg_finish_decompress(&state.codec);
    return true;
}

/// An open JPEG.
class JpegFile {
  public:
    JpegFile(const std::filesystem::path& path, const std::string& asked)
        : asked_(asked), file_(std::fopen(path.c_str(), "rbe"), &std::fclose) {
        if (!file_) throw InputError(asked, "the file cannot be opened", "check the permissions");
        if (!read_header(state_, file_.get())) refuse();
        const int components = state_.codec.num_components;
        if (components != 1 && components != 3 && components != 4)
            throw InputError(
                asked,
                "it is of a kind that is not supported (" + std::to_string(components) + " components)",
                convert_it);
    }

    [[nodiscard]] Size size() const {
        return {static_cast<int>(state_.codec.image_height), static_cast<int>(state_.codec.image_width)};
    }
    [[nodiscard]] Image read(const Crop& crop) {
        const int planes = state_.codec.num_components;
        Image image({crop.height, crop.width}, planes,
                    planes == 3 ? ColourSpace::srgb : ColourSpace::unspecified);
        if (planes == 1) image.set_plane_spaces({ColourSpace::srgb});
        std::vector<JSAMPLE> row(static_cast<std::size_t>(size().width) * static_cast<std::size_t>(planes));
        if (!read_rows(state_, row.data(), crop, image)) refuse();
        return image;
    }

  private:
    [[noreturn]] void refuse() const {
        const std::string why = valid_utf8(state_.message);
        const bool unknown = says_unsupported(why);
        throw InputError(
            asked_,
            unknown ? "it is of a kind that is not supported (" + why + ")" : "it is damaged (" + why + ")",
            unknown ? convert_it : use_a_complete_file);
    }
    const std::string& asked_;
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
    JpegState state_;
};

/// What Sony's and others' cameras mean by Adobe RGB (1998), whose exponent is 2 + 51/256.
ColourMeaning adobe_rgb() {
    ColourMeaning meaning;
    meaning.primaries = Chromaticities{0.64, 0.33, 0.21, 0.71, 0.15, 0.06, 0.3127, 0.3290};
    meaning.exponent = 563.0 / 256.0;
    meaning.said_by = "from Adobe RGB (1998), as its EXIF says";
    return meaning;
}

void apply_colours(Picture& picture, const JpegMarkers& markers, const Exif& exif, bool keep_values) {
    if (picture.image.planes() == 4) {
        if (markers.adobe)
            for (float& ink : picture.image.values()) ink = 1.0F - ink;
        if (markers.profile.empty()) return convert_cmyk(picture, keep_values);
    }
    ColourMeaning meaning;
    meaning.profile = markers.profile;
    if (markers.profile.empty() && exif.adobe_rgb && picture.image.planes() == 3) meaning = adobe_rgb();
    apply_meaning(picture, meaning, keep_values);
}

/// The decoder pads what is missing with grey; so the end is looked for here.
JpegMarkers jpeg_markers(const std::filesystem::path& path) {
    return MarkerReader(file_content(path)).read();
}

}  // namespace

Picture decode_jpeg(const std::filesystem::path& path, const ReadOptions& options, std::uintmax_t file_bytes,
                    const std::string& asked) {
    const JpegMarkers markers = jpeg_markers(path);
    if (!markers.missing_end.empty()) throw InputError(asked, markers.missing_end, use_a_complete_file);
    JpegFile file(path, asked);
    const Size size = file.size();
    check_packing(size, 4.0 * size.width, file_bytes, asked);
    static_cast<void>(chosen_part({{{}, compact_text_of(size), false}}, options.part, asked));
    Exif exif = read_exif(markers.exif);
    take_xmp(exif, markers.xmp);
    const Orientation orientation(exif.orientation);
    const Crop crop = checked_crop(options.crop, orientation.upright(size), asked);
    Picture picture;
    try {
        picture.image = file.read(orientation.stored(crop, size));
    } catch (const std::bad_alloc&) {
        throw InputError(asked, compact_text_of(crop) + " pixels do not fit in memory", "crop the picture");
    }
    if (markers.damaged_profile)
        picture.remarks.emplace_back("its colour profile is damaged and was ignored");
    apply_colours(picture, markers, exif, options.keep_values);
    make_upright(picture, orientation);
    if (exif.from_xmp) picture.remarks.emplace_back(xmp_orientation_remark);
    std::vector<std::string> names = channel_names(picture.image.planes());
    if (picture.image.planes() == 4) names = {"C", "M", "Y", "K"};
    keep_planes(picture, plan_channels(names, options.planes, -1, asked));
    return picture;
}

}  // namespace btfield::detail
