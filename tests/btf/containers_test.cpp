// host/btf/containers.cpp and byte_file.cpp.

#include "host/btf/containers.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "btfield/btf_output.hpp"
#include "btfield/btf_set.hpp"
#include "btfield/error.hpp"
#include "host/btf/byte_file.hpp"
#include "tests/btf_bytes.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

class BtfContainers : public testing::Test, protected test::BtfFile {
  protected:
    BtfContainers() : BtfFile("a") {}
};

void expect_values(const BtfSet& set) {
    ASSERT_EQ(set.size(), (Size{2, 3}));
    ASSERT_EQ(set.planes(), 3);
    ASSERT_EQ(set.views().size(), 2U);
    ASSERT_EQ(set.lights().size(), 2U);
    EXPECT_NEAR(set.views()[1].theta, std::numbers::pi / 6.0, 1e-6);
    EXPECT_NEAR(set.lights()[1].phi, std::numbers::pi / 0.9, 1e-6);
    for (const BtfPair& pair : set.pictures()) {
        const Image image = set.picture(pair.view, pair.light);
        for (int p = 0; p < 3; ++p)
            for (int y = 0; y < 2; ++y)
                for (int x = 0; x < 3; ++x)
                    ASSERT_EQ(image.at(p, y, x),
                              test::container_value(2 * pair.view + pair.light, 0, y, x, p));
    }
}

TEST_F(BtfContainers, AllThreeOfBothTypes) {
    for (const int scalar : {2, 4}) {
        const BtfSet tbig = open(test::tbig_bytes(scalar));
        EXPECT_EQ(tbig.format(), "tbig");
        EXPECT_EQ(tbig.space(), ColourSpace::linear);
        expect_values(tbig);
        const BtfSet tiles = open(test::tbig_bytes(scalar, 3));
        expect_values(tiles);
        EXPECT_EQ(tiles.description().remarks.size(), 1U);
        const BtfSet big = open(test::big_bytes(scalar));
        EXPECT_EQ(big.format(), "big");
        EXPECT_EQ(big.space(), ColourSpace::xyz);
        EXPECT_EQ(big.white(), 100.0);
        expect_values(big);
        const BtfSet mif = open(test::mif_bytes(scalar));
        EXPECT_EQ(mif.format(), "mif");
        EXPECT_EQ(mif.space(), ColourSpace::xyz);
        expect_values(mif);
    }
}

TEST_F(BtfContainers, TruncatedAndLyingFilesAreRefused) {
    for (const std::string& whole : {test::tbig_bytes(), test::big_bytes(), test::mif_bytes()}) {
        EXPECT_EQ(refusal(whole), "");
        for (std::size_t length = 0; length < whole.size(); length += 3)
            EXPECT_NE(refusal(whole.substr(0, length)), "") << length;
        for (std::size_t at = 0; at + 8 <= whole.size(); at += 4)
            for (const char* count :
                 {"\xff\xff\xff\xff\xff\xff\xff\x7f", "\x00\x00\x00\x01\x00\x00\x00\x00"}) {
                std::string bytes = whole;
                bytes.replace(at, 8, std::string(count, 8));
                static_cast<void>(refusal(bytes));
            }
    }
    std::string bytes = test::tbig_bytes();
    bytes.replace(4 * 24 + 16, 8, std::string("\xff\xff\xff\xff\xff\xff\xff\xff", 8));
    EXPECT_NE(refusal(bytes).find("several types"), std::string::npos);
}

/// Quarters: halves hold them.
class Quarters : public BtfSource {
  public:
    explicit Quarters(ColourSpace space, int planes = 3) {
        d_.format = "quarters";
        d_.size = {3, 5};
        d_.planes = planes;
        d_.space = space;
        if (space == ColourSpace::xyz) d_.white = 100.0;
        d_.views = {{0.0, 0.0}, {0.25, 1.0}};
        d_.lights = {{0.125, 0.5}, {0.5, 2.0}, {1.0, 4.0}};
        d_.present = {1, 1, 1, 1, 0, 1};
    }
    [[nodiscard]] const BtfDescription& description() const override { return d_; }
    [[nodiscard]] Image picture(int view, int light) const override {
        Image image(d_.size, d_.planes, d_.space);
        float value = static_cast<float>(10 * view + light);
        for (float& each : image.values()) each = value += 0.25F;
        return image;
    }
    BtfDescription d_;
};

TEST_F(BtfContainers, WrittenAndReadBackToTheBit) {
    for (const ColourSpace space : {ColourSpace::linear, ColourSpace::xyz})
        for (const BtfFormat format : {BtfFormat::tbig, BtfFormat::big, BtfFormat::mif})
            for (const PixelType type : {PixelType::half, PixelType::float32}) {
                if (format == BtfFormat::mif && space == ColourSpace::linear) continue;
                SCOPED_TRACE(std::string(name(format)) + " " + std::string(name(type)));
                const BtfSet set(std::make_shared<Quarters>(space));
                BtfWriteOptions options;
                options.format = format;
                options.type = type;
                const BtfWriteReport report = write_btf(folder_ / "out", set, options);
                EXPECT_EQ(report.pictures, 5U);
                EXPECT_EQ(report.bytes, std::filesystem::file_size(folder_ / "out"));
                const BtfSet back = BtfSet::open(folder_ / "out");
                EXPECT_EQ(back.space(), space);
                EXPECT_EQ(back.missing(), (std::vector<BtfPair>{{1, 1}}));
                for (const BtfPair& pair : set.pictures()) {
                    const Image one = set.picture(pair.view, pair.light),
                                other = back.picture(pair.view, pair.light);
                    ASSERT_TRUE(std::ranges::equal(one.values(), other.values()));
                    EXPECT_LT(
                        angle_between(set.light(pair.view, pair.light), back.light(pair.view, pair.light)),
                        1e-6);
                }
            }
}

TEST_F(BtfContainers, MifHoldsColoursAsXyz) {
    const BtfSet set(std::make_shared<Quarters>(ColourSpace::linear));
    BtfWriteOptions options;
    options.format = BtfFormat::mif;
    options.type = PixelType::float32;
    static_cast<void>(write_btf(folder_ / "out.mif", set, options));
    const BtfSet back = BtfSet::open(folder_ / "out.mif");
    const Image one = set.picture(1, 0), other = back.picture(1, 0);
    // Y of Rec. 709, white being 100.
    EXPECT_NEAR(other.at(1, 2, 2),
                100.0 * (0.2126 * one.at(0, 2, 2) + 0.7152 * one.at(1, 2, 2) + 0.0722 * one.at(2, 2, 2)),
                0.05);
}

TEST_F(BtfContainers, WhatTheyCannotHoldIsRefused) {
    const BtfSet set(std::make_shared<Quarters>(ColourSpace::linear));
    BtfWriteOptions options;
    options.format = BtfFormat::big;
    options.exposure = 0.5;
    EXPECT_THROW(static_cast<void>(write_btf(folder_ / "x", set, options)), InputError);
    options.exposure = 1.0;
    options.type = PixelType::uint8;
    EXPECT_THROW(static_cast<void>(write_btf(folder_ / "x", set, options)), InputError);
    EXPECT_TRUE(folder_.names().empty());
}

}  // namespace
}  // namespace btfield
