// host/btf/btf_set.cpp, directions.cpp, direction_grid.cpp and picture_folder.cpp.

#include "btfield/btf_set.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "host/btf/picture_folder.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using std::size_t;

double deg(double radians) {
    return radians * 180.0 / std::numbers::pi;
}

/// A grey picture whose bytes are all `value`.
void write_grey(const fs::path& file, float value, Size size = {2, 3}, int planes = 3) {
    fs::create_directories(file.parent_path());
    Image image(size, planes, planes == 3 ? ColourSpace::srgb : ColourSpace::unspecified);
    for (float& v : image.values()) v = value;
    WriteOptions options;
    options.keep_values = true;
    static_cast<void>(write_picture(file, image, options));
}

std::string refusal(const fs::path& path, const BtfOptions& options = {}) {
    try {
        static_cast<void>(BtfSet::open(path, options));
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

class BtfSets : public testing::Test {
  protected:
    test::TemporaryFolder folder_;
    [[nodiscard]] fs::path at(const std::string& name) const { return folder_.path() / name; }
};

TEST(BtfDirections, TablesHaveTheirRings) {
    const auto d81 = btf_directions_81(), d151 = btf_directions_151();
    ASSERT_EQ(d81.size(), 81U);
    ASSERT_EQ(d151.size(), 151U);
    EXPECT_NEAR(deg(d81[7].theta), 30.0, 1e-12);
    EXPECT_NEAR(deg(d81[38].phi), 18.0, 1e-12);
    EXPECT_NEAR(deg(d81[80].phi), 345.0, 1e-12);
    EXPECT_NEAR(deg(d151[1].phi), 15.0, 1e-12);
    EXPECT_NEAR(deg(d151[7].theta), 23.5, 1e-12);
    EXPECT_NEAR(deg(d151[150].phi), 345.0, 1e-12);
    for (const auto& table : {d81, d151})
        for (const BtfDirection& d : table) {
            const auto v = d.vector();
            EXPECT_NEAR(v[0] * v[0] + v[1] * v[1] + v[2] * v[2], 1.0, 1e-15);
            EXPECT_GT(v[2], 0.25);
        }
    EXPECT_NEAR(angle_between({0.5, 0.1}, {0.5, 0.1 + 2.0 * std::numbers::pi}), 0.0, 1e-12);
    EXPECT_NEAR(angle_between({0.0, 3.0}, {0.25, 1.0}), 0.25, 1e-12);
}

TEST(BtfNames, KeysInAnyOrderAndSpelling) {
    const auto expect = [](const char* name, double tl, double pl, double tv, double pv) {
        SCOPED_TRACE(name);
        const detail::NamedAngles a = detail::angles_of_name(name);
        ASSERT_TRUE(a.complete());
        EXPECT_EQ(*a.tl, tl);
        EXPECT_EQ(*a.pl, pl);
        EXPECT_EQ(*a.tv, tv);
        EXPECT_EQ(*a.pv, pv);
    };
    expect("00008 tl000 pl000 tv030 pv030", 0, 0, 30, 30);
    expect("tl075_pl345_tv015_pv060", 75, 345, 15, 60);
    expect("img_tv0_pv0_tl15_pl0", 15, 0, 0, 0);
    expect("tv22.5_pv-90.25_tl7.5_pl-180", 7.5, -180, 22.5, -90.25);
    expect("TL010-PL020-TV030-PV040", 10, 20, 30, 40);
    for (const char* name : {"tl000_pl000_tv000", "atl000_pl000_tv000_pv000", "tl_pl0_tv0_pv0",
                             "tlx0_pl0_tv0_pv0", "tl0x_pl0_tv0_pv0", ""})
        EXPECT_FALSE(detail::angles_of_name(name).complete()) << name;
    EXPECT_TRUE(detail::angles_of_name("00008 tl000 pl000 tv030 pv030").numbered);
    EXPECT_FALSE(detail::angles_of_name("tl000_pl000_tv030_pv030").numbered);
}

TEST_F(BtfSets, AFolderAsUtiaHasIt) {
    int shade = 0;
    for (const char* view : {"tv000_pv000", "tv060_pv018"})
        for (const char* light : {"tl000_pl000", "tl030_pl060", "tl045_pl300"})
            write_grey(at("set") / view / (std::string(light) + "_" + view + ".png"),
                       static_cast<float>(++shade * 40) / 255.0F);
    const BtfSet set = BtfSet::open(at("set"));
    EXPECT_EQ(set.format(), "utia");
    EXPECT_EQ(set.size(), (Size{2, 3}));
    EXPECT_EQ(set.planes(), 3);
    EXPECT_EQ(set.space(), ColourSpace::linear);
    EXPECT_GT(set.bytes(), 6U * 60U);
    ASSERT_EQ(set.views().size(), 2U);
    ASSERT_EQ(set.lights().size(), 3U);
    EXPECT_NEAR(deg(set.views()[1].phi), 18.0, 1e-12);
    EXPECT_TRUE(set.missing().empty());
    EXPECT_EQ(set.pictures().size(), 6U);
    shade = 0;
    for (int v = 0; v < 2; ++v)
        for (int l = 0; l < 3; ++l) {
            const double coded = ++shade * 40 / 255.0;
            const Image picture = set.picture(v, l);
            for (const float value : picture.values())
                EXPECT_NEAR(value, std::pow((coded + 0.055) / 1.055, 2.4), 1e-6);
        }
    EXPECT_THROW(static_cast<void>(set.picture(2, 0)), InputError);
    BtfOptions as_numbers;
    as_numbers.coding = BtfCoding::linear;
    EXPECT_NEAR(BtfSet::open(at("set"), as_numbers).picture(0, 0).values()[0], 40.0 / 255.0, 1e-6);
    as_numbers.coding = BtfCoding::gamma;
    EXPECT_NEAR(BtfSet::open(at("set"), as_numbers).picture(0, 0).values()[0], std::pow(40.0 / 255.0, 2.2),
                1e-6);
}

TEST_F(BtfSets, MissingPicturesAreToldAndDuplicatesRefused) {
    write_grey(at("s/tl000_pl000_tv000_pv000.png"), 0.5F);
    write_grey(at("s/tl015_pl060_tv000_pv000.png"), 0.5F);
    write_grey(at("s/tl015_pl060_tv015_pv000.png"), 0.5F);
    write_grey(at("s/readme.png"), 0.5F);
    const BtfSet set = BtfSet::open(at("s"));
    EXPECT_EQ(set.missing(), (std::vector<BtfPair>{{1, 0}}));
    EXPECT_FALSE(set.has(1, 0));
    EXPECT_THROW(static_cast<void>(set.picture(1, 0)), InputError);
    ASSERT_FALSE(set.description().remarks.empty());
    EXPECT_NE(set.description().remarks[0].find("1 picture whose name tells no directions"),
              std::string::npos);
    // A turn more is the same direction, and so is any phi from above.
    write_grey(at("s/tl015_pl420_tv000_pv090.png"), 0.5F);
    EXPECT_NE(refusal(at("s")).find("have the same directions"), std::string::npos);
}

TEST_F(BtfSets, LightInTheViewersWayIsMoved) {
    // As Bonn's sets have it: the name tells where the light was moved to.
    write_grey(at("s/00000 tl010 pl000 tv000 pv000.ppm"), 0.2F);
    write_grey(at("s/00001 tl015 pl000 tv000 pv000.ppm"), 0.4F);
    write_grey(at("s/00002 tl000 pl000 tv015 pv000.ppm"), 0.6F);
    write_grey(at("s/00003 tl005 pl000 tv015 pv000.ppm"), 0.8F);
    BtfOptions options;
    options.coding = BtfCoding::linear;
    const BtfSet set = BtfSet::open(at("s"), options);
    ASSERT_EQ(set.views().size(), 2U);
    ASSERT_EQ(set.lights().size(), 2U);
    EXPECT_TRUE(set.missing().empty());
    EXPECT_NEAR(deg(set.light(0, 0).theta), 10.0, 1e-9);
    EXPECT_NEAR(deg(set.light(1, 1).theta), 5.0, 1e-9);
    EXPECT_NEAR(deg(set.light(0, 1).theta), 15.0, 1e-9);
    EXPECT_NEAR(set.picture(1, 1).values()[0], 0.8F, 0.01F);
}

TEST_F(BtfSets, DirectionsThatAreNoTable) {
    for (const double tv : {0.0, 12.5})
        for (const double tl : {7.25, 40.0, 41.0})
            write_grey(at("s/tv" + std::to_string(tv) + "_pv-45_tl" + std::to_string(tl) + "_pl90.png"),
                       0.5F);
    const BtfSet set = BtfSet::open(at("s"));
    ASSERT_EQ(set.views().size(), 2U);
    ASSERT_EQ(set.lights().size(), 3U);
    EXPECT_NEAR(deg(set.views()[1].theta), 12.5, 1e-9);
    EXPECT_NEAR(deg(set.views()[1].phi), 315.0, 1e-9);
    EXPECT_NEAR(deg(set.lights()[0].theta), 7.25, 1e-9);
    EXPECT_TRUE(set.missing().empty());
    EXPECT_EQ(set.format(), "pictures");
}

TEST_F(BtfSets, WhatIsNoSetIsRefused) {
    EXPECT_NE(refusal(at("nowhere")).find("there is no such file or folder"), std::string::npos);
    fs::create_directories(at("empty"));
    EXPECT_NE(refusal(at("empty")).find("there are no pictures in it"), std::string::npos);
    write_grey(at("other/a.png"), 0.5F);
    EXPECT_NE(refusal(at("other")).find("no name of its 1 picture tells directions"), std::string::npos);
    EXPECT_NE(refusal(at("other/a.png")).find("it is of no known format"), std::string::npos);
    write_grey(at("below/tl095_pl000_tv000_pv000.png"), 0.5F);
    EXPECT_NE(refusal(at("below")).find("theta 95, phi 0"), std::string::npos);
    write_grey(at("sizes/tl000_pl000_tv000_pv000.png"), 0.5F);
    write_grey(at("sizes/tl015_pl000_tv000_pv000.png"), 0.5F, {4, 4});
    const BtfSet sizes = BtfSet::open(at("sizes"));
    try {
        static_cast<void>(sizes.picture(0, 1));
        FAIL() << "a picture of another size was taken";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("4 x 4 pixels and 3 planes"), std::string::npos);
        EXPECT_NE(std::string(error.what()).find("tl015"), std::string::npos);
    }
    BtfOptions crop;
    crop.crop = Crop{2, 0, 2, 2};
    EXPECT_NE(refusal(at("sizes"), crop).find("leaves pictures of 3 x 2 pixels"), std::string::npos);
}

/// Numbers that tell where they are.
class Counting : public BtfSource {
  public:
    Counting() {
        d_.format = "counting";
        d_.size = {4, 6};
        d_.planes = 1;
        d_.views = {{0.0, 0.0}, {0.3, 0.0}, {0.3, 1.0}};
        d_.lights = {{0.1, 0.0}, {0.2, 0.0}, {0.3, 0.0}, {0.4, 0.0}};
        d_.present.assign(12, 1);
        d_.present[2 * 4 + 2] = 0;
        d_.height = Image({4, 6}, 1);
        d_.height.at(0, 3, 4) = 8.0F;
    }
    [[nodiscard]] const BtfDescription& description() const override { return d_; }
    [[nodiscard]] Image picture(int view, int light) const override {
        Image image(d_.size, 1);
        for (int r = 0; r < 4; ++r)
            for (int c = 0; c < 6; ++c)
                image.at(0, r, c) = static_cast<float>(1000 * view + 100 * light + 10 * r + c);
        return image;
    }
    BtfDescription d_;
};

TEST(BtfSetOfAProgram, CropsAndStrides) {
    const auto source = std::make_shared<Counting>();
    BtfOptions options;
    options.crop = Crop{1, 1, 5, 3};
    options.pixel_stride = 2;
    options.view_stride = 2;
    options.light_stride = 2;
    const BtfSet set(source, options);
    EXPECT_EQ(set.size(), (Size{2, 3}));
    ASSERT_EQ(set.views().size(), 2U);
    ASSERT_EQ(set.lights().size(), 2U);
    EXPECT_EQ(set.missing(), (std::vector<BtfPair>{{1, 1}}));
    const Image image = set.picture(1, 0);
    EXPECT_EQ(image.at(0, 1, 2), 2035.0F);
    EXPECT_EQ(set.description().height.size(), (Size{2, 3}));
    // A height in pixels, which are twice as large now; the light that was meant.
    EXPECT_EQ(set.picture(0, 1).at(0, 0, 0), 211.0F);
    EXPECT_EQ(set.light(0, 1), set.lights()[1]);
    const BtfSet whole(source);
    EXPECT_EQ(whole.picture(2, 3).at(0, 3, 5), 2335.0F);
    EXPECT_EQ(whole.pictures().size(), 11U);
}

TEST(BtfSetOfAProgram, DescriptionsThatContradictThemselves) {
    for (int what = 0; what < 6; ++what) {
        const auto source = std::make_shared<Counting>();
        if (what == 0) source->d_.views.clear();
        if (what == 1) source->d_.size = {0, 4};
        if (what == 2) source->d_.names = {"a", "b"};
        if (what == 3) source->d_.true_lights.resize(3);
        if (what == 4) source->d_.present.resize(11);
        BtfOptions options;
        if (what == 5) options.view_stride = 0;
        EXPECT_THROW(BtfSet(source, options), InputError) << what;
    }
    const auto source = std::make_shared<Counting>();
    source->d_.planes = 2;
    EXPECT_THROW(static_cast<void>(BtfSet(source).picture(0, 0)), InputError);
}

}  // namespace
}  // namespace btfield
