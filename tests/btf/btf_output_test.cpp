// host/btf/btf_output.cpp, picture_coding.cpp and side_file.cpp.

#include "btfield/btf_output.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "btfield/btf_set.hpp"
#include "btfield/error.hpp"
#include "host/btf/picture_coding.hpp"
#include "host/btf/side_file.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;

/// Pictures of even and odd shades from 0 to 1, a missing one, and light that was moved.
class Shades : public BtfSource {
  public:
    explicit Shades(int planes = 3, ColourSpace space = ColourSpace::linear) {
        d_.format = "shades";
        d_.size = {8, 8};
        d_.planes = planes;
        d_.space = planes == 3 ? space : ColourSpace::unspecified;
        if (space == ColourSpace::xyz) d_.white = 100.0;
        d_.views = {{0.0, 0.0}, {radians(15), radians(60)}};
        d_.lights = {{0.0, 0.0}, {radians(15), radians(60)}, {radians(45), radians(340)}};
        d_.true_lights = {{radians(7.5), 0.0},          d_.lights[1], d_.lights[2], d_.lights[0],
                          {radians(22.5), radians(60)}, d_.lights[2]};
        d_.present = {1, 1, 0, 1, 1, 1};
        d_.height = Image({8, 8}, 1);
        d_.height.at(0, 3, 4) = 2.5F;
    }
    static double radians(double degrees) { return degrees * 3.14159265358979 / 180.0; }
    [[nodiscard]] const BtfDescription& description() const override { return d_; }
    [[nodiscard]] Image picture(int view, int light) const override {
        Image image(d_.size, d_.planes, d_.space);
        for (int p = 0; p < d_.planes; ++p)
            for (int i = 0; i < 64; ++i)
                image.plane(p)[static_cast<std::size_t>(i)] =
                    static_cast<float>((i * (p + 1) + 13 * view + 5 * light) % 64) / 63.0F *
                    static_cast<float>(d_.white);
        return image;
    }
    BtfDescription d_;
};

/// Largest difference of the pictures of both sets, whose directions are the same.
double difference(const BtfSet& a, const BtfSet& b) {
    EXPECT_EQ(a.pictures(), b.pictures());
    double most = 0.0;
    for (const BtfPair& pair : a.pictures()) {
        EXPECT_LT(angle_between(a.light(pair.view, pair.light), b.light(pair.view, pair.light)), 2e-6);
        const Image one = a.picture(pair.view, pair.light), other = b.picture(pair.view, pair.light);
        EXPECT_EQ(one.planes(), other.planes());
        for (std::size_t i = 0; i < one.values().size(); ++i)
            most = std::max(most, std::abs(static_cast<double>(one.values()[i]) -
                                           static_cast<double>(other.values()[i])));
    }
    return most;
}

BtfSet written(const fs::path& to, const BtfSet& set, BtfFormat format, std::optional<PixelType> type = {},
               double exposure = 1.0) {
    BtfWriteOptions options;
    options.format = format;
    options.type = type;
    options.exposure = exposure;
    const BtfWriteReport report = write_btf(to, set, options);
    EXPECT_EQ(report.pictures, set.pictures().size());
    EXPECT_EQ(report.clamped_pixels, 0U);
    return BtfSet::open(to);
}

TEST(BtfOutput, EveryFolderFormatComesBack) {
    const test::TemporaryFolder folder;
    const BtfSet set(std::make_shared<Shades>());
    const auto back = [&](const char* name, BtfFormat format, std::optional<PixelType> type = {},
                          double exposure = 1.0) {
        const BtfSet read = written(folder / name, set, format, type, exposure);
        EXPECT_EQ(read.description().height.at(0, 3, 4), 2.5F);
        EXPECT_EQ(read.space(), ColourSpace::linear);
        return difference(set, read);
    };
    // Half a step at white, of 8 bits: 2.3 / 255 / 2 of sRGB, 2.2 of gamma; 16 bits; shared exponents of 8.
    EXPECT_LE(back("png", BtfFormat::utia), 0.5 * 2.3 / 255.0);
    EXPECT_LE(back("png16", BtfFormat::utia, PixelType::uint16), 2.0 * 2.3 / 65535.0);
    EXPECT_LE(back("dark", BtfFormat::utia, PixelType::uint16, 0.25), 4.0 * 2.0 * 2.3 / 65535.0);
    EXPECT_EQ(back("exr", BtfFormat::utia, PixelType::float32), 0.0);
    EXPECT_EQ(back("bright", BtfFormat::utia, PixelType::float32, 4.0), 0.0);
    EXPECT_LE(back("half", BtfFormat::spectral), 0x1p-12);
    EXPECT_EQ(BtfSet::open(folder / "half").format(), "spectral");
    EXPECT_LE(back("hdr", BtfFormat::atrium), 1.0 / 256.0);
    EXPECT_LE(back("jpg", BtfFormat::ubo2003), 0.15);  // JPEG of noise
    EXPECT_TRUE(fs::exists(folder / "jpg/tv015_pv060/00003 tl000 pl000 tv015 pv060.jpg"));
    EXPECT_TRUE(fs::exists(folder / "png/tv000_pv000/tl007.5_pl000_tv000_pv000.png"));
    EXPECT_TRUE(fs::exists(folder / "half/tv015_pv060_tl045_pl340.exr"));
}

TEST(BtfOutput, ArchivesHoldFolders) {
    const test::TemporaryFolder folder;
    const BtfSet set(std::make_shared<Shades>());
    const BtfSet zip = written(folder / "set.zip", set, BtfFormat::utia, PixelType::float32, 0.5);
    EXPECT_EQ(zip.format(), "utia");
    EXPECT_EQ(difference(set, zip), 0.0);
    EXPECT_EQ(zip.description().height.at(0, 3, 4), 2.5F);
    EXPECT_LE(difference(set, written(folder / "jpg.zip", set, BtfFormat::ubo2003)), 0.15);
    EXPECT_LE(difference(set, written(folder / "png.ZIP", set, BtfFormat::utia)), 0.5 * 2.3 / 255.0);
    EXPECT_EQ(folder.names(), (std::vector<std::string>{"jpg.zip", "png.ZIP", "set.zip"}));
    // The first file's time and date are fixed: the same set makes the same bytes on any day.
    const std::string stamp = test::bytes_of(folder / "set.zip").substr(10, 4);
    EXPECT_EQ(stamp, std::string("\0\0\x21\0", 4));
    // Every shorter archive is refused, and so is one with a changed pixel: archives have checksums.
    const std::string whole = test::bytes_of(folder / "set.zip");
    const auto refused = [&](const std::string& bytes) {
        test::put_bytes(folder / "bad.zip", bytes);
        try {
            const BtfSet bad = BtfSet::open(folder / "bad.zip");
            for (const BtfPair& pair : bad.pictures()) static_cast<void>(bad.picture(pair.view, pair.light));
        } catch (const InputError&) {
            return true;
        }
        return false;
    };
    EXPECT_FALSE(refused(whole));
    for (std::size_t length = 4; length < whole.size(); length += whole.size() / 15)
        EXPECT_TRUE(refused(whole.substr(0, length))) << length;
    std::string changed = whole;
    changed[whole.find("tl000_pl000_tv015") + 400] ^= 1;
    EXPECT_TRUE(refused(changed));
    // A file of it that claims to be larger than any picture is not unpacked at all.
    std::string bomb = whole;
    const std::size_t entry = bomb.find("PK\x01\x02");
    for (const std::size_t field : {entry + 20, entry + 24}) bomb.replace(field, 4, "\xff\xff\xff\x7f");
    test::put_bytes(folder / "bad.zip", bomb);
    try {
        static_cast<void>(BtfSet::open(folder / "bad.zip"));
        ADD_FAILURE() << "2 GB were taken";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("unpack the archive"), std::string::npos) << error.what();
    }
    // Nothing is left of an archive that fails.
    BtfWriteOptions options;
    options.format = BtfFormat::spectral;
    options.exposure = 1e8;
    EXPECT_THROW(static_cast<void>(write_btf(folder / "half.zip", set, options)), InputError);
    EXPECT_FALSE(fs::exists(folder / "half.zip"));
}

TEST(BtfOutput, SpectraAndXyzStay) {
    const test::TemporaryFolder folder;
    const BtfSet spectra(std::make_shared<Shades>(7)), grey(std::make_shared<Shades>(1)),
        xyz(std::make_shared<Shades>(3, ColourSpace::xyz));
    EXPECT_EQ(difference(spectra, written(folder / "s", spectra, BtfFormat::spectral, PixelType::float32)),
              0.0);
    EXPECT_LE(difference(grey, written(folder / "g", grey, BtfFormat::utia)), 0.5 * 2.3 / 255.0);
    const BtfSet back = written(folder / "x", xyz, BtfFormat::utia, PixelType::float32);
    EXPECT_EQ(back.space(), ColourSpace::xyz);
    EXPECT_EQ(back.white(), 100.0);
    EXPECT_EQ(difference(xyz, back), 0.0);
}

TEST(BtfOutput, WhatIsBrighterThanWhiteIsCounted) {
    const test::TemporaryFolder folder;
    const BtfSet set(std::make_shared<Shades>(1));
    BtfWriteOptions options;
    options.exposure = 2.0;
    std::vector<std::uint64_t> steps;
    options.progress = [&](std::uint64_t done, std::uint64_t all) {
        EXPECT_EQ(all, 5U);
        steps.push_back(done);
    };
    // Shades n / 63 with 2 n > 63.
    EXPECT_EQ(write_btf(folder / "a", set, options).clamped_pixels, 5U * 32U);
    EXPECT_EQ(steps.back(), 5U);
    options.progress = [](std::uint64_t, std::uint64_t) { throw std::runtime_error("enough"); };
    EXPECT_THROW(static_cast<void>(write_btf(folder / "b", set, options)), std::runtime_error);
}

TEST(BtfOutput, WhatCannotBeWrittenIsRefused) {
    const test::TemporaryFolder folder;
    const BtfSet spectra(std::make_shared<Shades>(7));
    BtfWriteOptions options;
    EXPECT_THROW(static_cast<void>(write_btf(folder / "a", spectra, options)), InputError);
    options.format = BtfFormat::spectral;
    options.exposure = 0.0;
    EXPECT_THROW(static_cast<void>(write_btf(folder / "a", spectra, options)), InputError);
    options.exposure = 1e8;
    EXPECT_FALSE(fs::exists(folder / "a"));
    EXPECT_THROW(static_cast<void>(write_btf(folder / "b", spectra, options)), InputError);  // beyond halves
    test::put_bytes(folder / "file", "");
    EXPECT_THROW(check_btf_output(folder / "file", spectra.description(), {}), InputError);
}

TEST(BtfSideFile, StrictlyRead) {
    const detail::SideFile side = detail::parse_side_file(
        R"({"format": "btfield-btf", "version": 1, "exposure": 0.5, "height": "h.exr", "more": []})", "read");
    EXPECT_EQ(side.exposure, 0.5);
    EXPECT_FALSE(side.white);
    EXPECT_EQ(side.height, "h.exr");
    for (const char* bad :
         {"", "[]", "{}", R"({"format": "btfield-btf"})", R"({"format": "x", "version": 1})",
          R"({"format": "btfield-btf", "version": 1, "exposure": "1"})",
          R"({"format": "btfield-btf", "version": 1, "white": -1})",
          R"({"format": "btfield-btf", "version": 1, "height": "../h.exr"})",
          R"({"format": "btfield-btf", "version": 1, "height": 3})"})
        EXPECT_THROW(static_cast<void>(detail::parse_side_file(bad, "read")), InputError) << bad;
}

TEST(BtfPictureNames, Angles) {
    EXPECT_EQ(detail::angle_text(0.0), "000");
    EXPECT_EQ(detail::angle_text(Shades::radians(7.5)), "007.5");
    EXPECT_EQ(detail::angle_text(Shades::radians(-90.0)), "270");
    EXPECT_EQ(detail::angle_text(Shades::radians(12.34567)), "012.3457");
    EXPECT_EQ(detail::angle_text(Shades::radians(359.99999)), "000");
}

}  // namespace
}  // namespace btfield
