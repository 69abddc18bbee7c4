#include "host/pictures/png_colours.hpp"

#include <zlib.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "btfield/error.hpp"
#include "host/pictures/picture_format.hpp"

namespace btfield::detail {
namespace {

double word_at(std::string_view bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (const char c : bytes.substr(at, 4)) value = value << 8 | static_cast<unsigned char>(c);
    return value;
}

/// Empty when it is damaged.
std::string unpacked(std::string_view packed) {
    constexpr std::size_t most = std::size_t{64} << 20;
    for (std::size_t size = 1U << 16; size <= most; size *= 4) {
        std::string result(size, '\0');
        uLongf length = size;
        const int code = uncompress(reinterpret_cast<Bytef*>(result.data()), &length,
                                    reinterpret_cast<const Bytef*>(packed.data()), packed.size());
        if (code == Z_BUF_ERROR) continue;
        result.resize(code == Z_OK ? length : 0);
        return result;
    }
    return {};
}

/// Out of "NAME\0\0ZLIB"; empty when it is damaged.
std::string inflated(std::string_view chunk) {
    const std::size_t name = chunk.find('\0');
    if (name == std::string_view::npos || chunk.size() < name + 3 || chunk[name + 1] != '\0') return {};
    return unpacked(chunk.substr(name + 2));
}

/// ITU-T H.273, of those that still pictures have.
std::optional<Chromaticities> primaries_of_code(int code) {
    switch (code) {
        case 1:
            return rec709;
        case 4:
            return Chromaticities{0.67, 0.33, 0.21, 0.71, 0.14, 0.08, 0.310, 0.316};
        case 5:
            return Chromaticities{0.64, 0.33, 0.29, 0.60, 0.15, 0.06, 0.3127, 0.3290};
        case 6:
        case 7:
            return Chromaticities{0.630, 0.340, 0.310, 0.595, 0.155, 0.070, 0.3127, 0.3290};
        case 9:
            return Chromaticities{0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290};
        case 11:
            return Chromaticities{0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.314, 0.351};
        case 12:
            return Chromaticities{0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290};
        default:
            return std::nullopt;
    }
}

/// "Unspecified" in both lists.
constexpr int unsaid = 2;

}  // namespace

ColourMeaning meaning_of_code_points(std::string_view codes, const std::string& where, std::string& remark,
                                     const std::string& asked) {
    ColourMeaning meaning;
    const auto byte = [&](std::size_t i) { return static_cast<int>(static_cast<unsigned char>(codes[i])); };
    meaning.said_by = "from what its " + where + " says";
    const int primaries = byte(0), transfer = byte(1);
    if (transfer == 16 || transfer == 18)
        throw InputError(asked,
                         std::string("its transfer function is ") + (transfer == 16 ? "PQ" : "HLG") +
                             ", which is not supported",
                         convert_it);
    meaning.primaries = primaries_of_code(primaries);
    if (!meaning.primaries && primaries != unsaid)
        remark = "its " + where + " primaries, number " + std::to_string(primaries) +
                 ", are not known, and Rec. 709 is assumed";
    switch (transfer) {
        case unsaid:
        case 13:
            break;
        case 8:
            meaning.exponent = 1.0;
            break;
        case 4:
            meaning.exponent = 2.2;
            break;
        case 5:
            meaning.exponent = 2.8;
            break;
        case 1:
        case 6:
        case 14:
        case 15:
            meaning.rec709_curve = true;
            break;
        default:
            remark = "its " + where + " transfer function, number " + std::to_string(transfer) +
                     ", is not known, and sRGB is assumed";
    }
    return meaning;
}

std::string xmp_packet(std::string_view chunk) {
    // Keyword, whether it is packed, by which method, language, keyword in that language.
    const std::size_t name = chunk.find('\0');
    if (name == std::string_view::npos || chunk.size() < name + 3) return {};
    const bool packed = chunk[name + 1] == '\1';
    std::size_t at = name + 3;
    for (int text = 0; text < 2; ++text) {
        at = chunk.find('\0', at);
        if (at == std::string_view::npos) return {};
        ++at;
    }
    return packed ? unpacked(chunk.substr(at)) : std::string(chunk.substr(at));
}

ColourMeaning meaning_of(const PngChunks& chunks, std::string& remark, const std::string& asked) {
    ColourMeaning meaning;
    if (chunks.code_points.size() == 4) {
        meaning = meaning_of_code_points(chunks.code_points, "cICP", remark, asked);
        meaning.narrow_range = chunks.code_points[3] == '\0';
        if (chunks.code_points[2] != '\0' && remark.empty())
            remark = "its cICP says that it is no RGB, which a PNG always is, and RGB is assumed";
        return meaning;
    }
    if (!chunks.profile.empty()) {
        meaning.profile = inflated(chunks.profile);
        if (meaning.profile.empty()) remark = "its colour profile is damaged and was ignored";
        return meaning;
    }
    if (chunks.has_srgb) return meaning;
    if (chunks.gamma.size() == 4) {
        const double gamma = word_at(chunks.gamma, 0) / 100000.0;
        // 0.45455 is how files without a better word say sRGB.
        if (gamma > 0.0 && std::abs(gamma - 1.0 / 2.2) > 0.005) meaning.exponent = 1.0 / gamma;
    }
    if (chunks.primaries.size() == 32) {
        // White comes first.
        Chromaticities& given = meaning.primaries.emplace();
        for (std::size_t i = 0; i < 8; ++i) given[(i + 6) % 8] = word_at(chunks.primaries, 4 * i) / 100000.0;
    }
    meaning.said_by =
        std::string("from what its ") + (meaning.exponent && meaning.primaries ? "gAMA and cHRM say"
                                         : meaning.exponent                    ? "gAMA says"
                                                                               : "cHRM says");
    return meaning;
}

}  // namespace btfield::detail
