// host/btf/ubo2014.cpp, ubo2014_header.cpp and colour_models.cpp.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "btfield/btf_set.hpp"
#include "btfield/error.hpp"
#include "tests/btf_bytes.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using test::ubo2014_bytes;
using test::ubo2014_value;
using test::Ubo2014Case;

class Ubo2014 : public testing::Test, protected test::BtfFile {
  protected:
    Ubo2014() : BtfFile("a.btf") {}
};

double deg(double radians) {
    return radians * 180.0 / std::numbers::pi;
}

/// All pictures, with views and lights in the order of their rings: 0 before 45 degrees, 11, 30, 75.
void expect_values(const BtfSet& set, std::uint32_t channels, bool sparse = false) {
    ASSERT_EQ(set.size(), (Size{2, 3}));
    ASSERT_EQ(set.planes(), static_cast<int>(channels));
    ASSERT_EQ(set.views().size(), 2U);
    ASSERT_EQ(set.lights().size(), 3U);
    EXPECT_NEAR(deg(set.views()[1].phi), 200.0, 1e-4);
    EXPECT_NEAR(deg(set.lights()[1].phi), 195.0, 1e-4);
    EXPECT_EQ(set.missing(), (std::vector<BtfPair>{{1, 2}}));
    for (const BtfPair& pair : set.pictures()) {
        const Image image = set.picture(pair.view, pair.light);
        const auto n = static_cast<std::uint32_t>(3 * pair.view + pair.light);
        for (std::uint32_t c = 0; c < channels; ++c)
            for (std::uint32_t x = 0; x < 6; ++x) {
                const double expected = sparse && (x == 2 || x == 4) ? 0.0 : ubo2014_value(c, n, x);
                ASSERT_NEAR(image.plane(static_cast<int>(c))[x], expected, 1e-5)
                    << "channel " << c << ", pixel " << x;
            }
    }
}

TEST_F(Ubo2014, EveryKindAndTranspose) {
    for (const char* signature :
         {"!FMF06FC", "!FMF06FCR", "!FMF12FCER", "!DFMF08FCR", "!PVF06FC", "!PVF06FCR"})
        for (const bool by_pixel : {false, true})
            for (const int scalar : {2, 4, 8}) {
                SCOPED_TRACE(std::string(signature) + (by_pixel ? " by pixel " : " ") +
                             std::to_string(scalar));
                Ubo2014Case what;
                what.signature = signature;
                what.by_pixel = by_pixel;
                what.scalar = scalar;
                const BtfSet set = open(ubo2014_bytes(what));
                expect_values(set, 3);
                EXPECT_EQ(set.space(), ColourSpace::linear);
            }
    EXPECT_EQ(open(ubo2014_bytes()).format(), "ubo2014-fmf");
}

TEST_F(Ubo2014, OldPvf) {
    Ubo2014Case what;
    what.signature = "!PVF06FC";
    what.old_pvf = true;
    const BtfSet set = open(ubo2014_bytes(what));
    EXPECT_EQ(set.format(), "ubo2014-pvf");
    expect_values(set, 3);
}

TEST_F(Ubo2014, Texels) {
    Ubo2014Case what;
    what.signature = "!BDIF06R2!";
    expect_values(open(ubo2014_bytes(what)), 3);
    what.compression = 2;
    expect_values(open(ubo2014_bytes(what)), 3, true);
    what.compression = 1;
    EXPECT_NE(refusal(ubo2014_bytes(what)).find("packed by bzip"), std::string::npos);
}

TEST_F(Ubo2014, VersionsAndChannels) {
    for (const std::uint32_t version : {1U, 2U, 3U}) {
        Ubo2014Case what;
        what.version = version;
        expect_values(open(ubo2014_bytes(what)), 3);
    }
    Ubo2014Case what;
    what.version = 4;
    what.channels = 5;
    const BtfSet set = open(ubo2014_bytes(what));
    expect_values(set, 5);
    EXPECT_EQ(set.space(), ColourSpace::unspecified);
    EXPECT_EQ(set.picture(0, 0).names(), (std::vector<std::string>{"c0", "c1", "c2", "c3", "c4"}));
}

TEST_F(Ubo2014, LogarithmsAndHeight) {
    Ubo2014Case what;
    what.signature = "!FMF12FCER";
    const BtfSet plain = open(ubo2014_bytes(what));
    ASSERT_EQ(plain.description().height.size(), (Size{2, 3}));
    EXPECT_EQ(plain.description().height.at(0, 1, 2), 1.25F);
    what.logarithms = 1;
    const double logarithm = ubo2014_value(1, 1, 2);
    EXPECT_NEAR(open(ubo2014_bytes(what)).picture(0, 1).plane(1)[2], std::exp(logarithm) - 1e-5, 1e-3);
    what.extras = 1;
    EXPECT_EQ(open(ubo2014_bytes(what)).description().height.planes(), 0);
    what.extras = 0;
    expect_values(open(ubo2014_bytes(what)), 3);
}

TEST_F(Ubo2014, ColourModels) {
    // Channels of picture 0 at pixel 0.
    const std::array<double, 3> v{ubo2014_value(0, 0, 0), ubo2014_value(1, 0, 0), ubo2014_value(2, 0, 0)};
    const double e = 1e-5, y = std::exp(v[0]) - e;
    const auto yuv = [](double a, double b, double c) {
        return std::array<double, 3>{a + 1.13983 * c, a - 0.39465 * b - 0.5806 * c, a + 2.03211 * b};
    };
    const std::vector<std::pair<int, std::array<double, 3>>> cases{
        {0, v},
        {1, yuv(v[0], v[1], v[2])},
        // Mean 0, .25, .5, matrix of rows 0 .5 1, 1.5 2 2.5, 3 3.5 4.
        {3,
         {1.5 * v[1] + 3 * v[2], 0.25 + 0.5 * v[0] + 2 * v[1] + 3.5 * v[2],
          0.5 + v[0] + 2.5 * v[1] + 4 * v[2]}},
        {4, {v[0] + v[1] - v[2], v[0] + v[2], v[0] - v[1] - v[2]}},
        {5, {(1 - v[1] - v[2]) * v[0], v[1] * v[0], v[2] * v[0]}},
        {6, {3 * v[0] - (v[1] + v[2]) / 3, 3 * v[0] * (1 + v[1]), 3 * v[0] * (1 + v[2])}},
        {9, yuv(y, v[1], v[2])},
        {10, yuv(y, std::exp(v[1] + std::log(e)), std::exp(v[2] + std::log(e)))},
        {11, yuv(y, v[1] * (y + e), v[2] * (y + e))},
        {12, {y, std::exp(v[1]) - e, std::exp(v[2]) - e}}};
    for (const auto& [model, expected] : cases) {
        SCOPED_TRACE(model);
        Ubo2014Case what;
        what.signature = "!DFMF08FCR";
        what.colour_model = model;
        const Image image = open(ubo2014_bytes(what)).picture(0, 0);
        for (int p = 0; p < 3; ++p)
            EXPECT_NEAR(image.at(p, 0, 0), expected[static_cast<std::size_t>(p)],
                        1e-6 * (1.0 + std::abs(expected[static_cast<std::size_t>(p)])));
    }
    Ubo2014Case what;
    what.signature = "!DFMF08FCR";
    what.colour_model = 2;
    EXPECT_NE(refusal(ubo2014_bytes(what)).find("its colour model is 2"), std::string::npos);
}

TEST_F(Ubo2014, TruncatedAndLyingFilesAreRefused) {
    std::vector<Ubo2014Case> cases(5);
    cases[1].signature = "!FMF12FCER";
    cases[2].signature = "!DFMF08FCR";
    cases[3].signature = "!PVF06FCR";
    cases[4].signature = "!BDIF06R2!";
    for (const Ubo2014Case& what : cases) {
        SCOPED_TRACE(what.signature);
        const std::string whole = ubo2014_bytes(what);
        EXPECT_EQ(refusal(whole), "");
        // Every shorter file is told from a whole one.
        for (std::size_t length = 0; length < whole.size(); length += 1 + length / 40)
            EXPECT_NE(refusal(whole.substr(0, length)), "") << length;
        // A count somewhere is all ones: refused or still what it was, never a crash or gigabytes.
        for (std::size_t at = 0; at + 4 <= whole.size(); at += at < 24 || at > 260 ? 3 : 40) {
            std::string bytes = whole;
            bytes.replace(at, 4, "\xff\xff\xff\xff");
            static_cast<void>(refusal(bytes));
        }
    }
    EXPECT_NE(refusal("!FMF07FC and more bytes").find("no known format"), std::string::npos);
}

}  // namespace
}  // namespace btfield
