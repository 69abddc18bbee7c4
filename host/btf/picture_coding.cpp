#include "host/btf/picture_coding.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/text.hpp"
#include "host/btf/direction_grid.hpp"
#include "host/pictures/colour.hpp"
#include "host/pictures/stored_picture.hpp"

namespace btfield::detail {
namespace {

namespace fs = std::filesystem;
using std::size_t;

std::string extension_of(const fs::path& file) {
    std::string extension = file.extension().string();
    for (char& c : extension)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return extension;
}

/// A curve at n/65535.
template <typename Curve>
std::vector<float> table_of_curve(const Curve& curve) {
    std::vector<float> table(65536);
    for (size_t i = 0; i < table.size(); ++i)
        table[i] = static_cast<float>(curve(static_cast<double>(i) / 65535.0));
    return table;
}

const std::vector<float>& srgb_decoding() {
    static const std::vector<float> table = table_of_curve([](double x) { return srgb_decoded(x); });
    return table;
}

const std::vector<float>& gamma_decoding() {
    static const std::vector<float> table = table_of_curve([](double x) { return std::pow(x, 2.2); });
    return table;
}

/// A 65535th is a fortieth of the narrowest step of 8 bits.
const std::vector<float>& srgb_encoding() {
    static const std::vector<float> table = table_of_curve([](double x) { return srgb_encoded(x); });
    return table;
}

float looked_up(float value, const std::vector<float>& table) {
    const float place = std::clamp(value, 0.0F, 1.0F) * 65535.0F;
    return table[static_cast<size_t>(std::lround(place))];
}

bool is_integer(PixelType type) {
    return type == PixelType::uint8 || type == PixelType::uint16;
}

/// Of each format, as far as the type asked for leaves a choice.
PixelType type_of(const BtfWriteOptions& options) {
    switch (options.format) {
        case BtfFormat::utia:
        case BtfFormat::ubo2003:
            return options.type.value_or(PixelType::uint8);
        case BtfFormat::atrium:
            return options.type.value_or(PixelType::float32);
        default:
            break;
    }
    return options.type.value_or(PixelType::half);
}

std::string extension_for(BtfFormat format, PixelType type) {
    if (format == BtfFormat::ubo2003) return ".jpg";
    if (format == BtfFormat::atrium) return ".hdr";
    return format == BtfFormat::utia && is_integer(type) ? ".png" : ".exr";
}

}  // namespace

ReadOptions BtfDecoder::reading(const fs::path& file) const {
    ReadOptions reading;
    const std::string extension = extension_of(file);
    const bool floats = extension == ".exr" || extension == ".hdr";
    reading.keep_values = !(options_.coding == BtfCoding::automatic && floats);
    return reading;
}

Image BtfDecoder::operator()(Picture picture, const fs::path& file) const {
    Image image = std::move(picture.image);
    const bool floats = !is_integer(picture.type);
    BtfCoding coding = options_.coding;
    if (coding == BtfCoding::automatic) {
        const std::string extension = extension_of(file);
        const bool jpeg = extension == ".jpg" || extension == ".jpeg" || extension == ".jpe";
        coding = floats ? BtfCoding::linear : jpeg ? BtfCoding::gamma : BtfCoding::srgb;
    }
    if (coding == BtfCoding::srgb || coding == BtfCoding::gamma) {
        const bool srgb = coding == BtfCoding::srgb;
        const std::vector<float>& table = srgb ? srgb_decoding() : gamma_decoding();
        for (float& value : image.values())
            value = !floats ? looked_up(value, table)
                    : srgb  ? static_cast<float>(srgb_decoded(static_cast<double>(value)))
                            : std::pow(std::max(value, 0.0F), 2.2F);
        image.set_space(ColourSpace::linear);
    }
    if (exposure_ != 1.0)
        for (float& value : image.values())
            value = static_cast<float>(static_cast<double>(value) / exposure_);
    if (image.space() != ColourSpace::xyz) image.set_space(ColourSpace::linear);
    if (options_.space) image.set_space(*options_.space);
    if (image.planes() != 3) image.set_space(ColourSpace::unspecified);
    return image;
}

BtfEncoder::BtfEncoder(const BtfDescription& set, const BtfWriteOptions& options, const std::string& asked)
    : format_(options.format), exposure_(static_cast<float>(options.exposure)) {
    if (!(options.exposure > 0.0) || !std::isfinite(options.exposure))
        throw InputError(asked, "the exposure is " + std::to_string(options.exposure),
                         "give a number above 0");
    const PixelType type = type_of(options);
    extension_ = extension_for(format_, type);
    storage_ = storage_for("picture" + extension_, set.planes, type, type, asked);
    check_sides(storage_.format, set.size, asked);
    // XYZ stays what it is in files that can say so.
    white_ = set.space == ColourSpace::xyz && extension_ != ".exr" ? static_cast<float>(set.white) : 1.0F;
}

fs::path BtfEncoder::name(const BtfDirection& view, const BtfDirection& light, std::uint64_t number) const {
    const std::string tv = angle_text(view.theta), pv = angle_text(view.phi), tl = angle_text(light.theta),
                      pl = angle_text(light.phi);
    const std::string folder = "tv" + tv + "_pv" + pv;
    if (format_ == BtfFormat::spectral) return "tv" + tv + "_pv" + pv + "_tl" + tl + "_pl" + pl + extension_;
    if (format_ == BtfFormat::utia)
        return fs::path(folder) / ("tl" + tl + "_pl" + pl + "_tv" + tv + "_pv" + pv + extension_);
    char digits[24];
    std::snprintf(digits, sizeof digits, "%05llu", static_cast<unsigned long long>(number));
    return fs::path(folder) /
           (std::string(digits) + " tl" + tl + " pl" + pl + " tv" + tv + " pv" + pv + extension_);
}

std::uintmax_t BtfEncoder::write(const fs::path& to, Image image, const std::string& asked) const {
    const float scale = exposure_ / white_;
    const bool integers = is_integer(storage_.type);
    std::uintmax_t clamped = 0;
    if (scale != 1.0F)
        for (float& value : image.values()) value *= scale;
    if (image.space() == ColourSpace::xyz && extension_ != ".exr") convert(image, ColourSpace::linear);
    for (const float value : image.values())
        if (!std::isfinite(value))
            throw InputError(asked, "a value is not a finite number", "make sure that all of them are");
    const float top = integers ? 1.0F : std::numeric_limits<float>::max();
    for (size_t i = 0; i < area(image.size()) && (integers || extension_ == ".hdr"); ++i) {
        bool outside = false;
        for (int p = 0; p < image.planes(); ++p)
            outside = outside || image.plane(p)[i] < 0.0F || image.plane(p)[i] > top;
        clamped += outside ? 1 : 0;
    }
    if (integers) {
        for (float& value : image.values())
            value =
                storage_.format == PictureFormat::jpeg ? std::pow(std::clamp(value, 0.0F, 1.0F), 1.0F / 2.2F)
                : storage_.type == PixelType::uint8
                    ? looked_up(value, srgb_encoding())
                    : static_cast<float>(srgb_encoded(static_cast<double>(std::clamp(value, 0.0F, 1.0F))));
        image.set_space(image.planes() == 3 ? ColourSpace::srgb : ColourSpace::unspecified);
    } else if (storage_.type == PixelType::half) {
        for (const float value : image.values())
            if (!(std::abs(value) <= 65519.0F))
                throw InputError(asked, "a value is " + std::to_string(value) + ", too large for half floats",
                                 "write type float, or with a lower exposure");
    }
    store_picture(to, image, storage_, asked);
    return clamped;
}

std::string angle_text(double radians) {
    double angle = std::fmod(degrees(radians), 360.0);
    if (angle < 0.0) angle += 360.0;
    if (angle > 360.0 - 5e-5) angle = 0.0;
    char text[32];
    if (std::abs(angle - std::round(angle)) < 5e-5) {
        std::snprintf(text, sizeof text, "%03.0f", std::round(angle));
        return text;
    }
    std::snprintf(text, sizeof text, "%08.4f", angle);
    std::string result = text;
    result.erase(result.find_last_not_of('0') + 1);
    return result;
}

}  // namespace btfield::detail
