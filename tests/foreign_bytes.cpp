#include "tests/foreign_bytes.hpp"

#include <lcms2.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include <jpeglib.h>

#include "tests/picture_bytes.hpp"

namespace btfield::test {
namespace {

std::string saved(cmsHPROFILE profile) {
    cmsUInt32Number size = 0;
    cmsSaveProfileToMem(profile, nullptr, &size);
    std::string bytes(size, '\0');
    cmsSaveProfileToMem(profile, bytes.data(), &size);
    cmsCloseProfile(profile);
    return bytes;
}

/// White where no corner has ink, black elsewhere; a and b are 0.
cmsInt32Number sample_inks(const cmsUInt16Number inks[], cmsUInt16Number lab[], void* /*data*/) {
    lab[0] = inks[0] == 0 && inks[1] == 0 && inks[2] == 0 && inks[3] == 0 ? 0xffff : 0;
    lab[1] = lab[2] = 0x8080;
    return 1;
}

}  // namespace

std::string profile_bytes(const std::optional<Chromaticities>& primaries, double exponent) {
    cmsToneCurve* const curve = cmsBuildGamma(nullptr, exponent);
    const std::array<cmsToneCurve*, 3> curves{curve, curve, curve};
    const cmsCIExyY white{0.3127, 0.3290, 1.0};
    cmsHPROFILE profile = nullptr;
    if (primaries) {
        const Chromaticities& c = *primaries;
        const cmsCIExyYTRIPLE triple{{c[0], c[1], 1}, {c[2], c[3], 1}, {c[4], c[5], 1}};
        profile = cmsCreateRGBProfile(&white, &triple, curves.data());
    } else {
        profile = cmsCreateGrayProfile(&white, curve);
    }
    cmsFreeToneCurve(curve);
    return saved(profile);
}

std::string srgb_profile_bytes() {
    return saved(cmsCreate_sRGBProfile());
}

std::string ink_profile_bytes() {
    const cmsHPROFILE profile = cmsCreateProfilePlaceholder(nullptr);
    cmsSetProfileVersion(profile, 4.3);
    cmsSetDeviceClass(profile, cmsSigOutputClass);
    cmsSetColorSpace(profile, cmsSigCmykData);
    cmsSetPCS(profile, cmsSigLabData);
    cmsWriteTag(profile, cmsSigMediaWhitePointTag, cmsD50_XYZ());
    cmsPipeline* const pipeline = cmsPipelineAlloc(nullptr, 4, 3);
    cmsStage* const table = cmsStageAllocCLut16bit(nullptr, 2, 4, 3, nullptr);
    cmsStageSampleCLut16bit(table, &sample_inks, nullptr, 0);
    // Curves on both sides, as the file's kind of table has them.
    cmsPipelineInsertStage(pipeline, cmsAT_END, cmsStageAllocToneCurves(nullptr, 4, nullptr));
    cmsPipelineInsertStage(pipeline, cmsAT_END, table);
    cmsPipelineInsertStage(pipeline, cmsAT_END, cmsStageAllocToneCurves(nullptr, 3, nullptr));
    cmsWriteTag(profile, cmsSigAToB0Tag, pipeline);
    cmsPipelineFree(pipeline);
    return saved(profile);
}

std::string ink_jpeg(const std::array<unsigned char, 4>& inks, bool adobe) {
    jpeg_compress_struct codec{};
    jpeg_error_mgr errors{};
    codec.err = jpeg_std_error(&errors);
    jpeg_create_compress(&codec);
    unsigned char* bytes = nullptr;
    unsigned long size = 0;
    jpeg_mem_dest(&codec, &bytes, &size);
    codec.image_width = codec.image_height = 8;
    codec.input_components = 4;
    codec.in_color_space = JCS_CMYK;
    jpeg_set_defaults(&codec);
    jpeg_set_quality(&codec, 100, TRUE);
    codec.write_Adobe_marker = adobe ? TRUE : FALSE;
    jpeg_start_compress(&codec, TRUE);
    std::array<unsigned char, 32> row{};
    for (std::size_t i = 0; i < row.size(); ++i) row.at(i) = inks.at(i % 4);
    JSAMPROW line = row.data();
    for (int r = 0; r < 8; ++r) jpeg_write_scanlines(&codec, &line, 1);
    jpeg_finish_compress(&codec);
    std::string result(reinterpret_cast<const char*>(bytes), size);
    jpeg_destroy_compress(&codec);
    std::free(bytes);
    return result;
}

std::string with_segments(const std::string& jpeg, const std::vector<std::pair<int, std::string>>& segments) {
    std::string result = jpeg.substr(0, 2);
    for (const auto& [marker, content] : segments)
        result += '\xff' + std::string(1, static_cast<char>(marker)) +
                  big_endian(static_cast<std::uint32_t>(content.size() + 2), 2) + content;
    return result + jpeg.substr(2);
}

}  // namespace btfield::test
