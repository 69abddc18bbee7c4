#include "host/pictures/colour_profile.hpp"

#include <lcms2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "host/base/text.hpp"

namespace btfield::detail {
namespace {

struct CloseProfile {
    void operator()(void* profile) const { cmsCloseProfile(profile); }
};
struct DeleteTransform {
    void operator()(void* transform) const { cmsDeleteTransform(transform); }
};
using Profile = std::unique_ptr<void, CloseProfile>;
using Transform = std::unique_ptr<void, DeleteTransform>;

bool is_integer_type(PixelType type) {
    return type == PixelType::uint8 || type == PixelType::uint16;
}

/// Linear light of Rec. 709.
Profile linear_profile() {
    const cmsCIExyY white{rec709[6], rec709[7], 1.0};
    const cmsCIExyYTRIPLE primaries{
        {rec709[0], rec709[1], 1.0}, {rec709[2], rec709[3], 1.0}, {rec709[4], rec709[5], 1.0}};
    cmsToneCurve* const curve = cmsBuildGamma(nullptr, 1.0);
    const std::array<cmsToneCurve*, 3> curves{curve, curve, curve};
    Profile profile(cmsCreateRGBProfile(&white, &primaries, curves.data()));
    cmsFreeToneCurve(curve);
    return profile;
}

/// Whether the profile's numbers are linear light.
bool is_linear(cmsHPROFILE profile) {
    const auto straight = [&](cmsTagSignature tag) {
        const auto* curve = static_cast<const cmsToneCurve*>(cmsReadTag(profile, tag));
        return curve != nullptr && std::abs(cmsEvalToneCurveFloat(curve, 0.5F) - 0.5F) < 2e-3F &&
               std::abs(cmsEvalToneCurveFloat(curve, 0.1F) - 0.1F) < 2e-3F;
    };
    if (cmsGetColorSpace(profile) == cmsSigGrayData) return straight(cmsSigGrayTRCTag);
    return straight(cmsSigRedTRCTag) && straight(cmsSigGreenTRCTag) && straight(cmsSigBlueTRCTag);
}

std::string title_of(cmsHPROFILE profile) {
    std::array<char, 128> text{};
    cmsGetProfileInfoASCII(profile, cmsInfoDescription, "en", "US", text.data(),
                           static_cast<cmsUInt32Number>(text.size() - 1));
    std::string title = valid_utf8(text.data());
    for (char& c : title)
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
    return title.empty() ? "its colour profile" : "its colour profile '" + title + "'";
}

/// From the planes of the profile's space to linear Rec. 709.
class IccConversion {
  public:
    explicit IccConversion(const std::string& bytes) {
        cmsSetLogErrorHandler(nullptr);
        profile_.reset(cmsOpenProfileFromMem(bytes.data(), static_cast<cmsUInt32Number>(bytes.size())));
        if (!profile_) return;
        // A number: a damaged profile has any, also those that the enumeration lacks.
        const auto space = static_cast<std::uint32_t>(cmsGetColorSpace(profile_.get()));
        cmsUInt32Number type = 0;
        if (space == cmsSigRgbData) {
            channels_ = 3;
            type = TYPE_RGB_FLT;
        } else if (space == cmsSigGrayData) {
            channels_ = 1;
            type = TYPE_GRAY_FLT;
        } else if (space == cmsSigCmykData) {
            channels_ = 4;
            type = TYPE_CMYK_FLT;
        } else {
            return;
        }
        const bool print = channels_ == 4;
        transform_.reset(cmsCreateTransform(
            profile_.get(), type, linear_profile().get(), TYPE_RGB_FLT,
            print ? INTENT_PERCEPTUAL : INTENT_RELATIVE_COLORIMETRIC,
            cmsFLAGS_NOOPTIMIZE | cmsFLAGS_NOCACHE | (print ? cmsFLAGS_BLACKPOINTCOMPENSATION : 0U)));
    }
    [[nodiscard]] bool works() const { return transform_ != nullptr; }
    [[nodiscard]] bool opened() const { return profile_ != nullptr; }
    [[nodiscard]] int channels() const { return channels_; }
    [[nodiscard]] cmsHPROFILE profile() const { return profile_.get(); }

    /// Interleaved on both sides; CMYK in percent, as Little CMS has it.
    void run(const std::vector<float>& from, std::vector<float>& to, std::size_t pixels) const {
        cmsDoTransform(transform_.get(), from.data(), to.data(), static_cast<cmsUInt32Number>(pixels));
    }

    /// Whether sRGB-encoded numbers, as far as 8 bits tell, are what the profile means.
    [[nodiscard]] bool is_srgb() const {
        if (channels_ == 4) return false;
        constexpr int steps = 9;
        std::vector<float> from;
        for (int r = 0; r < steps; ++r)
            for (int g = 0; g < (channels_ == 3 ? steps : 1); ++g)
                for (int b = 0; b < (channels_ == 3 ? steps : 1); ++b)
                    for (const int v : {r, g, b})
                        if (channels_ == 3 || from.size() <= static_cast<std::size_t>(r))
                            from.push_back(static_cast<float>(v) / (steps - 1));
        const std::size_t pixels = from.size() / static_cast<std::size_t>(channels_);
        std::vector<float> to(3 * pixels);
        run(from, to, pixels);
        for (std::size_t i = 0; i < to.size(); ++i) {
            const float given = channels_ == 3 ? from[i] : from[i / 3];
            if (!(std::abs(srgb_encoded(static_cast<double>(to[i])) - static_cast<double>(given)) < 0.004))
                return false;
        }
        return true;
    }

    [[nodiscard]] Image converted(const Image& image) const {
        const auto channels = static_cast<std::size_t>(channels_);
        const int planes = channels_ == 1 ? 1 : 3;
        Image result(image.size(), planes, ColourSpace::linear);
        const auto width = static_cast<std::size_t>(image.width());
        std::vector<float> from(width * channels), to(width * 3);
        for (std::size_t start = 0; start < area(image.size()); start += width) {
            for (std::size_t c = 0; c < channels; ++c) {
                const auto row = image.plane(static_cast<int>(c)).subspan(start, width);
                for (std::size_t i = 0; i < width; ++i)
                    from[i * channels + c] = channels_ == 4 ? 100.0F * row[i] : row[i];
            }
            run(from, to, width);
            for (int p = 0; p < planes; ++p) {
                const auto row = result.plane(p).subspan(start, width);
                for (std::size_t i = 0; i < width; ++i) row[i] = to[i * 3 + static_cast<std::size_t>(p)];
            }
        }
        return result;
    }

  private:
    Profile profile_;
    Transform transform_;
    int channels_ = 0;
};

/// Linear values become what pictures of the type have.
void finish(Picture& picture, bool linear) {
    if (linear) {
        picture.image.set_space(ColourSpace::linear);
        return;
    }
    encode_srgb(picture.image);
    if (picture.image.planes() == 3)
        picture.image.set_space(ColourSpace::srgb);
    else
        picture.image.set_plane_spaces({ColourSpace::srgb});
}

void apply_profile(Picture& picture, const std::string& profile, bool keep_values) {
    const IccConversion conversion(profile);
    if (!conversion.works() || conversion.channels() != picture.image.planes()) {
        picture.remarks.emplace_back(
            !conversion.opened() ? "its colour profile is damaged and was ignored"
            : conversion.works()
                ? title_of(conversion.profile()) + " is of another kind of colours and was ignored"
                : title_of(conversion.profile()) + " is of a kind that is not supported and was ignored");
        if (picture.image.planes() == 4) convert_cmyk(picture, keep_values);
        return;
    }
    if (conversion.is_srgb() && is_integer_type(picture.type)) return;
    if (keep_values) {
        picture.image.set_space(ColourSpace::unspecified);
        return;
    }
    const bool light = is_linear(conversion.profile());
    const bool linear = light || !is_integer_type(picture.type);
    picture.image = conversion.converted(picture.image);
    finish(picture, linear);
    picture.remarks.push_back(std::string("colours were converted to ") +
                              (linear ? "linear Rec. 709" : "sRGB") + " by " +
                              title_of(conversion.profile()));
}

/// By straight lines between what the curve has.
double on_curve(const std::vector<double>& curve, double value) {
    const double place = std::clamp(value, 0.0, 1.0) * static_cast<double>(curve.size() - 1);
    const auto below = std::min(static_cast<std::size_t>(place), curve.size() - 2);
    const double part = place - static_cast<double>(below);
    return (1.0 - part) * curve[below] + part * curve[below + 1];
}

/// Black and white of narrow range to 0 and 1.
void widen(Picture& picture) {
    const double steps = picture.type == PixelType::uint16 ? 256.0 : 1.0;
    const double top = picture.type == PixelType::uint16 ? 65535.0 : 255.0;
    for (float& value : picture.image.values())
        value = static_cast<float>((static_cast<double>(value) * top - 16.0 * steps) / (219.0 * steps));
    picture.remarks.emplace_back(
        "its values are of narrow range (black at 16, white at 235), and became full");
}

/// Value as linear light.
double light_of(double value, const ColourMeaning& meaning, const std::vector<double>& curve, bool integer) {
    if (curve.size() > 1) return on_curve(curve, value);
    if (meaning.exponent) return value < 0.0 ? value : std::pow(value, *meaning.exponent);
    if (meaning.rec709_curve)
        return value < 0.081 ? value / 4.5 : std::pow((value + 0.099) / 1.099, 1.0 / 0.45);
    return integer ? srgb_decoded(value) : value;
}

}  // namespace

void convert_cmyk(Picture& picture, bool keep_values) {
    if (keep_values) return;
    const Image ink = std::move(picture.image);
    picture.image = Image(ink.size(), 3, ColourSpace::srgb);
    for (int p = 0; p < 3; ++p)
        for (std::size_t i = 0; i < area(ink.size()); ++i)
            picture.image.plane(p)[i] = (1.0F - ink.plane(p)[i]) * (1.0F - ink.plane(3)[i]);
    picture.remarks.emplace_back("it is CMYK without a profile that can be used, and became RGB as 1 - ink");
}

void apply_meaning(Picture& picture, const ColourMeaning& meaning, bool keep_values) {
    const int planes = picture.image.planes();
    if (meaning.narrow_range && keep_values) return picture.image.set_space(ColourSpace::unspecified);
    if (meaning.narrow_range) widen(picture);
    if (!meaning.profile.empty() && (planes == 1 || planes == 3 || planes == 4)) {
        apply_profile(picture, meaning.profile, keep_values);
        return;
    }
    if (planes != 1 && planes != 3) return;
    const bool integer = is_integer_type(picture.type);
    const bool other_primaries =
        planes == 3 && meaning.primaries && !same_primaries(*meaning.primaries, rec709, 4e-3);
    const bool light = meaning.exponent && std::abs(*meaning.exponent - 1.0) < 0.01;
    const bool curves = meaning.curves.front().size() > 1;
    if (!other_primaries && !meaning.exponent && !meaning.rec709_curve && !curves) return;
    if (light && !other_primaries) {
        picture.image.set_space(ColourSpace::linear);
        return;
    }
    if (keep_values) {
        picture.image.set_space(ColourSpace::unspecified);
        return;
    }
    for (int p = 0; p < planes; ++p)
        for (float& value : picture.image.plane(p))
            value = static_cast<float>(light_of(static_cast<double>(value), meaning,
                                                meaning.curves.at(static_cast<std::size_t>(p)), integer));
    if (other_primaries) {
        if (const auto matrix = rec709_from(*meaning.primaries)) {
            transform(picture.image, *matrix);
        } else {
            picture.remarks.emplace_back("its primaries span no colours, and Rec. 709 is assumed");
        }
    }
    finish(picture, light || !integer);
    picture.remarks.push_back(std::string("colours were converted to ") +
                              (light || !integer ? "linear Rec. 709 " : "sRGB ") + meaning.said_by);
}

}  // namespace btfield::detail
