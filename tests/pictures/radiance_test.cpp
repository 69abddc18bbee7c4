// Radiance pictures, put together byte by byte.

#include "host/pictures/radiance.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using test::put_bytes;
using test::TemporaryFolder;

class Radiance : public testing::Test {
  protected:
    /// 2 x 3 or as `size` says, pixels 1 to 6 in red, of exponent 0.
    Picture read(const std::string& lines, const std::string& size = "-Y 2 +X 3",
                 const ReadOptions& options = {}) {
        std::string bytes = "#?RADIANCE\n" + lines + "\n" + size + "\n";
        for (char k = 1; k <= 6; ++k) bytes += std::string{k, '\100', '\200', '\210'};
        put_bytes(folder_ / "a.hdr", bytes);
        return read_picture(folder_ / "a.hdr", options);
    }
    std::string refusal(const std::string& bytes) {
        put_bytes(folder_ / "b.hdr", bytes);
        try {
            static_cast<void>(read_picture(folder_ / "b.hdr"));
        } catch (const InputError& error) {
            return error.what();
        }
        return "read";
    }
    TemporaryFolder folder_;
    const std::string rgbe_ = "FORMAT=32-bit_rle_rgbe\n";
};

TEST_F(Radiance, EightOrientations) {
    const std::array<std::pair<const char*, std::array<int, 6>>, 8> cases{
        {{"-Y 2 +X 3", {1, 2, 3, 4, 5, 6}},
         {"-Y 2 -X 3", {3, 2, 1, 6, 5, 4}},
         {"+Y 2 -X 3", {6, 5, 4, 3, 2, 1}},
         {"+Y 2 +X 3", {4, 5, 6, 1, 2, 3}},
         {"+X 2 -Y 3", {1, 4, 2, 5, 3, 6}},
         {"-X 2 -Y 3", {4, 1, 5, 2, 6, 3}},
         {"-X 2 +Y 3", {6, 3, 5, 2, 4, 1}},
         {"+X 2 +Y 3", {3, 6, 2, 5, 1, 4}}}};
    for (const auto& [size, expected] : cases) {
        const Picture picture = read(rgbe_, size);
        EXPECT_EQ(picture.image.width(), size[1] == 'Y' ? 3 : 2) << size;
        for (std::size_t i = 0; i < 6; ++i)
            EXPECT_EQ(picture.image.plane(0)[i], static_cast<float>(expected.at(i))) << size;
        EXPECT_EQ(picture.remarks.size(), std::string(size) == "-Y 2 +X 3" ? 0U : 1U) << size;
    }
}

TEST_F(Radiance, ExposureGammaCorrectionAndPrimaries) {
    EXPECT_EQ(read(rgbe_ + "EXPOSURE=2\nEXPOSURE= 4\n").image.at(0, 0, 1), 0.25F);
    EXPECT_EQ(read(rgbe_ + "EXPOSURE=2\n").remarks.size(), 1U);
    EXPECT_TRUE(read(rgbe_ + "EXPOSURE=1\nGAMMA=1\n").remarks.empty());
    EXPECT_EQ(read(rgbe_ + "COLORCORR= 1 2 4\n").image.at(2, 0, 0), 32.0F);
    EXPECT_NEAR(read(rgbe_ + "GAMMA=2.2\n").image.at(0, 0, 2), std::pow(3.0F, 2.2F), 1e-4F);
    const Picture kept = read(rgbe_ + "GAMMA=2.2\n", "-Y 2 +X 3", {{}, {}, {}, true});
    EXPECT_EQ(kept.image.at(0, 0, 2), 3.0F);
    EXPECT_EQ(kept.image.space(), ColourSpace::unspecified);
    const Picture wide = read(rgbe_ + "PRIMARIES= .68 .32 .265 .69 .15 .06 .3127 .3290\n");
    EXPECT_TRUE(wide.chromaticities);
    EXPECT_EQ(wide.remarks.size(), 1U);
    EXPECT_LT(wide.image.at(0, 0, 0), 0.0F);
    EXPECT_EQ(read("FORMAT=32-bit_rle_xyze\n").image.space(), ColourSpace::xyz);
    EXPECT_EQ(read(rgbe_).image.space(), ColourSpace::linear);
}

TEST_F(Radiance, RunLengthsOldAndNew) {
    // One pixel, and one that repeats it eight times; then 256 + 1 more.
    const std::string pixel = "\1\2\3\210";
    put_bytes(folder_ / "old.hdr", "#?RGBE\n" + rgbe_ + "\n-Y 1 +X 9\n" + pixel + "\1\1\1\10");
    const Picture old = read_picture(folder_ / "old.hdr");
    for (const float v : old.image.plane(2)) EXPECT_EQ(v, 3.0F);
    Image image({3, 300}, 3, ColourSpace::linear);
    for (int c = 0; c < 300; ++c)
        for (int p = 0; p < 3; ++p)
            for (int r = 0; r < 3; ++r)
                image.at(p, r, c) = c < 200 ? 0.5F : static_cast<float>(c % 7 + p + 1);
    write_picture(folder_ / "new.hdr", image);
    const Picture again = read_picture(folder_ / "new.hdr");
    for (std::size_t i = 0; i < image.values().size(); ++i)
        EXPECT_NEAR(again.image.values()[i], image.values()[i], image.values()[i] / 100.0F + 0.03F);
    EXPECT_LT(std::filesystem::file_size(folder_ / "new.hdr"), 3U * 300U * 4U / 2U);
}

TEST_F(Radiance, XyzIsWrittenAsRgbAndTold) {
    Image image({1, 8}, 3, ColourSpace::xyz);
    for (float& v : image.plane(0)) v = 0.95047F;
    for (float& v : image.plane(1)) v = 1.0F;
    for (float& v : image.plane(2)) v = 1.08883F;
    const WriteReport report = write_picture(folder_ / "a.hdr", image);
    ASSERT_EQ(report.remarks.size(), 1U);
    EXPECT_NE(report.remarks[0].find("XYZ"), std::string::npos);
    const Picture read_back = read_picture(folder_ / "a.hdr");
    for (const float v : read_back.image.values()) EXPECT_NEAR(v, 1.0F, 0.01F);
}

TEST_F(Radiance, DamageAndUnknownKindsAreToldApart) {
    const auto says = [](const std::string& message, const char* part) {
        return message.find(part) != std::string::npos;
    };
    EXPECT_TRUE(says(refusal("#?RADIANCE\nFORMAT=32-bit_rle_lab\n\n-Y 1 +X 1\nabcd"), "not supported"));
    EXPECT_TRUE(says(refusal("#?RADIANCE\n" + rgbe_ + "EXPOSURE=0\n\n-Y 1 +X 1\nabcd"), "EXPOSURE"));
    EXPECT_TRUE(says(refusal("#?RADIANCE\n" + rgbe_ + "\n-Y 1 +Z 1\nabcd"), "does not end in a size"));
    EXPECT_TRUE(says(refusal("#?RADIANCE\n" + rgbe_ + "\n-Y 1 +X 2\nabcd"), "it ends inside its pixel data"));
    EXPECT_TRUE(says(refusal("#?RADIANCE\n" + rgbe_ + "\n-Y 1 +X 8\n" + std::string("\2\2\0\11", 4)),
                     "another length"));
    EXPECT_TRUE(says(refusal("#?RADIANCE\n" + rgbe_), "it ends inside its header"));
}

}  // namespace
}  // namespace btfield
