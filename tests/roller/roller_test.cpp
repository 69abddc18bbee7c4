#include "btfield/roller.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <stdexcept>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "tests/device_cases.hpp"
#include "tests/places.hpp"

namespace btfield {
namespace {

const std::string data = test::data_folder();

SourceMap quilt(Device& device, const Image& sample, Size size, const RollerOptions& options = {}) {
    return Roller(device, std::span(&sample, 1)).quilt(size, options);
}

/// Values that say where a pixel stands.
Image places(Size size) {
    Image image(size, 1);
    std::iota(image.values().begin(), image.values().end(), 0.0F);
    return image;
}

/// A pattern that repeats every `period` pixels along both axes.
Image pattern(Size size, int period) {
    Image image(size, 3);
    for (int p = 0; p < 3; ++p)
        for (int r = 0; r < size.height; ++r)
            for (int c = 0; c < size.width; ++c)
                image.at(p, r, c) = static_cast<float>((r % period * 5 + c % period * (3 + p) + 7 * p) % 11);
    return image;
}

void expect_whole(const SourceMap& map, Size size, Size sample) {
    EXPECT_EQ(map.size, size);
    EXPECT_EQ(map.sample, sample);
    ASSERT_EQ(map.source.size(), area(size));
    for (const std::uint32_t source : map.source) ASSERT_LT(source, area(sample));
}

class RollerSmall : public testing::TestWithParam<int> {
  protected:
    Device device_ = test::device_of_width(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Widths, RollerSmall, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(RollerSmall, QuiltIsTheSameOnEveryDevice) {
    const Image sample = test::mixed_texture({24, 30}, 2, 5);
    RollerOptions options;
    options.block = 12;
    options.seed = 3;
    const SourceMap map = quilt(device_, sample, {33, 29}, options);
    expect_whole(map, {33, 29}, {24, 30});
    Device other = test::device_of_width(1);
    EXPECT_EQ(map.source, quilt(other, sample, {33, 29}, options).source);
}

TEST(Roller, UnitsOfUnlikePlanesChangeNothing) {
    const Image sample = test::mixed_texture({48, 40}, 2, 5);
    Image other = sample;
    for (float& v : other.plane(1)) v *= 4096.0F;
    Device device;
    EXPECT_EQ(quilt(device, sample, {96, 80}).source, quilt(device, other, {96, 80}).source);
}

TEST(Roller, ClFftMakesTheSame) {
    const Image sample = read_picture(data + "/bark.png").image;
    Device lanes, clfft = test::device_of_width(0, FftBackend::clfft);
    EXPECT_EQ(quilt(lanes, sample, {200, 150}).source, quilt(clfft, sample, {200, 150}).source);
}

TEST(Roller, AnySizeIsFilled) {
    Device device;
    const Image sample = test::mixed_texture({40, 53}, 3, 1);
    Roller roller(device, std::span(&sample, 1));
    for (const Size size : {Size{16, 16}, Size{16, 200}, Size{97, 16}, Size{53, 40}, Size{101, 67}})
        for (const int block : {8, 11, 40}) {
            SCOPED_TRACE(test::text(size) + ", blocks of " + std::to_string(block));
            RollerOptions options;
            options.block = block;
            expect_whole(roller.quilt(size, options), size, sample.size());
            options.overlap = block / 2;
            expect_whole(roller.quilt(size, options), size, sample.size());
            options.overlap = 2;
            expect_whole(roller.quilt(size, options), size, sample.size());
        }
}

TEST(Roller, RegularPatternsGoOnWithoutASeam) {
    Device device;
    const Image sample = pattern({60, 52}, 8);
    RollerOptions options;
    options.block = 24;
    options.overlap = 8;
    const SourceMap map = quilt(device, sample, {96, 80}, options);  // multiples of the period
    EXPECT_EQ(map.cut_cost, 0.0);
    const Image texture = apply(map, sample);
    for (int p = 0; p < 3; ++p)
        for (int r = 0; r < 96; ++r)
            for (int c = 0; c < 80; ++c) {
                ASSERT_EQ(texture.at(p, r, c), texture.at(p, (r + 8) % 96, c)) << r << ", " << c;
                ASSERT_EQ(texture.at(p, r, c), texture.at(p, r, (c + 8) % 80)) << r << ", " << c;
            }
    // As a tile of whole periods.
    const SourceMap tile = Roller(device, std::span(&sample, 1)).tile(Size{40, 32});
    EXPECT_EQ(tile.cut_cost, 0.0);
    const Image tiled = apply(tile, sample);
    for (int r = 0; r < 40; ++r)
        for (int c = 0; c < 32; ++c) {
            ASSERT_EQ(tiled.at(0, r, c), tiled.at(0, (r + 8) % 40, c)) << r << ", " << c;
            ASSERT_EQ(tiled.at(0, r, c), tiled.at(0, r, (c + 8) % 32)) << r << ", " << c;
        }
}

TEST(Roller, RegisteredPicturesAreCutAlike) {
    Device device;
    const std::vector<Image> sample{read_picture(data + "/bark.png").image,
                                    read_picture(data + "/grass.png").image};
    const Size size = sample[0].size();
    ASSERT_EQ(size, sample[1].size());
    Roller roller(device, sample);
    EXPECT_EQ(roller.sample_size(), size);
    const SourceMap map = roller.quilt({150, 170});
    const Image where = apply(map, places(size));
    const Image bark = apply(map, sample[0]), grass = apply(map, sample[1]);
    EXPECT_EQ(bark.planes(), sample[0].planes());
    EXPECT_EQ(bark.space(), sample[0].space());
    for (int r = 0; r < 150; ++r)
        for (int c = 0; c < 170; ++c) {
            const int at = static_cast<int>(where.at(0, r, c));
            ASSERT_EQ(bark.at(1, r, c), sample[0].at(1, at / size.width, at % size.width));
            ASSERT_EQ(grass.at(0, r, c), sample[1].at(0, at / size.width, at % size.width));
        }
    // The second picture has its say in the cuts.
    EXPECT_NE(map.source, quilt(device, sample[0], {150, 170}).source);
}

TEST(Roller, UnitsOfAPictureDoNotMatter) {
    Device device;
    std::vector<Image> sample{read_picture(data + "/bark.png").image,
                              read_picture(data + "/grass.png").image};
    const SourceMap map = Roller(device, sample).quilt({128, 128});
    for (float& value : sample[1].values()) value = 1024.0F * value;
    EXPECT_EQ(map.source, Roller(device, sample).quilt({128, 128}).source);
}

TEST(Roller, TellsHowFarItIs) {
    Device device;
    const Image sample = test::mixed_texture({40, 40}, 1, 5);
    Roller roller(device, std::span(&sample, 1));
    std::vector<double> shares;
    RollerOptions options;
    options.progress = [&](double share) { shares.push_back(share); };
    (void)roller.quilt({100, 80}, options);
    ASSERT_GT(shares.size(), 3U);
    EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
    EXPECT_EQ(shares.back(), 1.0);
    options.progress = [](double) { throw std::runtime_error("enough"); };
    EXPECT_THROW((void)roller.quilt({100, 80}, options), std::runtime_error);
}

TEST(Roller, SeedsDecide) {
    Device device;
    const Image sample = read_picture(data + "/rock.png").image;
    Roller roller(device, std::span(&sample, 1));
    std::set<std::vector<std::uint32_t>> seen;
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
        RollerOptions options;
        options.seed = seed;
        seen.insert(roller.quilt({100, 100}, options).source);
        EXPECT_EQ(roller.quilt({100, 100}, options).source, roller.quilt({100, 100}, options).source);
    }
    EXPECT_EQ(seen.size(), 4U);
}

/// Mean and deviation of a plane.
std::pair<double, double> moments(const Image& image, int plane) {
    double sum = 0.0, squares = 0.0;
    for (const float v : image.plane(plane)) sum += static_cast<double>(v);
    const double mean = sum / static_cast<double>(area(image.size()));
    for (const float v : image.plane(plane))
        squares += (static_cast<double>(v) - mean) * (static_cast<double>(v) - mean);
    return {mean, std::sqrt(squares / static_cast<double>(area(image.size())))};
}

TEST(Roller, RealPicturesGrowWithoutSeams) {
    Device device;
    std::vector<double> seams;
    for (const char* name : {"bark", "grass", "rock", "sand", "cork"}) {
        SCOPED_TRACE(name);
        const Image sample = read_picture(data + "/" + name + ".png").image;
        Roller roller(device, std::span(&sample, 1));
        const SourceMap large = roller.quilt({2 * sample.height(), 2 * sample.width()});
        const SourceMap tile = roller.tile();
        EXPECT_GE(tile.size.height, sample.height() / 2);
        EXPECT_GE(tile.size.width, sample.width() / 2);
        const Image texture = apply(large, sample);
        for (int p = 0; p < sample.planes(); ++p) {
            const auto [mean, deviation] = moments(sample, p);
            const auto [grown_mean, grown_deviation] = moments(texture, p);
            // A patch of 3/16 of the sample's side more or less of bright or dark, of the 114 that it has.
            EXPECT_NEAR(grown_mean, mean, 0.1 * deviation) << "plane " << p;
            EXPECT_NEAR(grown_deviation, deviation, 0.1 * deviation) << "plane " << p;
        }
        for (const SourceMap* map : {&large, &tile}) {
            EXPECT_GT(map->seam, 0.5);
            EXPECT_LT(map->seam, 1.7);
            seams.push_back(map->seam);
        }
    }
    std::sort(seams.begin(), seams.end());
    EXPECT_LE(seams[seams.size() / 2], 1.25);
}

TEST(Roller, TilesHaveOneBorder) {
    Device device;
    const Image sample = read_picture(data + "/grass.png").image;
    Roller roller(device, std::span(&sample, 1));
    RollerOptions options;
    options.overlap = 10;
    const std::vector<SourceMap> tiles = roller.tiles(4, Size{60, 52}, options);
    ASSERT_EQ(tiles.size(), 4U);
    for (const SourceMap& tile : tiles) {
        expect_whole(tile, {60, 52}, sample.size());
        for (int r = 0; r < 60; ++r)
            for (int c = 0; c < 52; ++c) {
                if (r >= 5 && r < 55 && c >= 5 && c < 47) continue;
                const std::size_t i = static_cast<std::size_t>(r * 52 + c);
                ASSERT_EQ(tile.source[i], tiles[0].source[i]) << "row " << r << ", column " << c;
            }
        EXPECT_EQ(std::count_if(tiles.begin(), tiles.end(),
                                [&](const SourceMap& t) { return t.source == tile.source; }),
                  1);
    }
    const std::vector<SourceMap> found = roller.tiles(2);
    EXPECT_EQ(found[0].size, found[1].size);
    EXPECT_LE(found[0].size.height, sample.height() / 2);
}

template <class Work>
void expect_refused(const char* part, Work work) {
    try {
        work();
        ADD_FAILURE() << "not refused: " << part;
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
}

TEST(Roller, RefusesWhatCannotBe) {
    Device device;
    const Image sample = test::mixed_texture({40, 50}, 1, 2);
    const auto roller = [&](const std::vector<Image>& pictures) { return Roller(device, pictures); };
    expect_refused("there is no picture", [&] { roller({}); });
    expect_refused("50 x 40 and 40 x 50", [&] { roller({sample, test::mixed_texture({50, 40}, 1, 2)}); });
    expect_refused("15 pixels", [&] { roller({test::mixed_texture({15, 50}, 1, 2)}); });
    expect_refused("one value everywhere", [&] { roller({Image({40, 50}, 3)}); });
    Image broken = sample;
    broken.at(0, 3, 4) = std::numeric_limits<float>::quiet_NaN();
    expect_refused("not a finite number", [&] { roller({broken}); });

    Roller whole(device, std::span(&sample, 1));
    const auto with = [](auto set) {
        RollerOptions options;
        set(options);
        return options;
    };
    expect_refused("a side is below 16", [&] { (void)whole.quilt({15, 100}); });
    expect_refused("patches of 41", [&] {
        (void)whole.quilt({99, 99}, with([](auto& o) { o.block = 41; }));
    });
    expect_refused("patches of 7", [&] { (void)whole.quilt({99, 99}, with([](auto& o) { o.block = 7; })); });
    expect_refused("overlap of 9", [&] {
        (void)whole.quilt({99, 99}, with([](auto& o) { o.block = 16, o.overlap = 9; }));
    });
    expect_refused("tolerance", [&] {
        (void)whole.quilt({99, 99}, with([](auto& o) { o.tolerance = -1; }));
    });
    expect_refused("at most 45", [&] {
        (void)whole.tile(Size{30, 49}, with([](auto& o) { o.overlap = 5; }));
    });
    expect_refused("overlap of 16", [&] {
        (void)whole.tile(Size{30, 30}, with([](auto& o) { o.overlap = 16; }));
    });
    expect_refused("0 are asked for", [&] { (void)whole.tiles(0); });
    expect_refused("the sample that was cut is 50 x 40", [&] {
        (void)apply(whole.quilt({64, 64}), test::mixed_texture({40, 51}, 1, 2));
    });
}

}  // namespace
}  // namespace btfield
