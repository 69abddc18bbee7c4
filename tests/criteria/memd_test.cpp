#include "btfield/memd.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/cl/device_impl.hpp"
#include "host/criteria/colour_tree.hpp"
#include "host/criteria/memd_search.hpp"
#include "tests/device_cases.hpp"
#include "tests/places.hpp"
#include "tests/reference/memd.hpp"

namespace btfield {

using namespace detail;

namespace {

constexpr std::array metrics{Metric::max, Metric::l1, Metric::l2};

/// A row of grey pixels, values in units 0…255.
Image grey(const std::vector<int>& values) {
    Image image({1, static_cast<int>(values.size())}, 1);
    for (std::size_t i = 0; i < values.size(); ++i)
        image.values()[i] = static_cast<float>(values[i]) / 255.0F;
    return image;
}

/// Values on a grid of `levels` steps from `low` to `high`; no grid for 0.
Image picture(std::mt19937& generator, Size size, int planes, int levels, float low = 0.0F,
              float high = 1.0F) {
    Image image(size, planes);
    std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
    for (float& value : image.values()) {
        const float u = uniform(generator);
        const float step =
            levels > 1 ? std::round(u * static_cast<float>(levels - 1)) / static_cast<float>(levels - 1)
                       : (levels == 1 ? 0.0F : u);
        value = low + (high - low) * step;
    }
    return image;
}

Device& device() {
    return test::default_device();
}

Memd with_errors(Device& on, const Image& a, const Image& b, MemdOptions options = {}) {
    options.local_errors = true;
    return memd(on, a, b, options);
}

void expect_equal(const Memd& found, const Memd& expected) {
    EXPECT_EQ(found.memd, expected.memd);  // to the bit: that is the definition
    EXPECT_EQ(found.local_errors, expected.local_errors);
    EXPECT_EQ(found.pixels, expected.pixels);
}

TEST(Memd, TwoPixels) {
    // Theory 15.2: 10 takes 11, the nearer; 11 has only 8 left.
    const Memd result = with_errors(device(), grey({10, 11}), grey({11, 8}));
    EXPECT_EQ(result.memd, 2.0);
    EXPECT_EQ(result.local_errors, (std::vector<float>{1.0F, 3.0F}));
    EXPECT_EQ(result.memd_star, 100.0 * 2.0 / 255.0);
}

TEST(Memd, EightBitValuesAreWholeUnits) {
    for (int k = 0; k < 256; ++k)
        EXPECT_EQ(reference::colour_value(static_cast<float>(k) / 255.0F, 1.0), static_cast<float>(k));
}

TEST(Memd, LowestRasterIndexAmongEquals) {
    // 10 is as near to 9 as to 11. Taking the first, 9, leaves 11 for 11; taking 11 would leave 9: error 2.
    EXPECT_EQ(with_errors(device(), grey({10, 11}), grey({9, 11})).local_errors,
              (std::vector<float>{1.0F, 0.0F}));
    EXPECT_EQ(with_errors(device(), grey({10, 11}), grey({11, 9})).local_errors,
              (std::vector<float>{1.0F, 2.0F}));
}

TEST(Memd, EqualPicturesHaveNoError) {
    std::mt19937 generator(1);
    for (const int levels : {0, 4, 256}) {
        const Image image = picture(generator, {23, 17}, 3, levels);
        for (const Metric metric : metrics) EXPECT_EQ(memd(device(), image, image, metric).memd, 0.0);
    }
}

TEST(Memd, ConstantPictures) {
    Image a({7, 5}, 3), b({7, 5}, 3);
    for (float& value : a.values()) value = 1.0F;
    EXPECT_EQ(memd(device(), a, b, Metric::max).memd, 255.0);
    EXPECT_EQ(memd(device(), a, b, Metric::l1).memd, 3 * 255.0);
    for (const Metric metric : metrics)
        // Two roots, a product and a quotient, each rounded to float64.
        EXPECT_NEAR(memd(device(), a, b, metric).memd_star, 100.0, 100.0 * 4 * 1.2e-16) << name(metric);
}

TEST(Memd, NoPixelOfAIsLeftOutSilently) {
    std::mt19937 generator(2);
    const Image large = picture(generator, {9, 8}, 3, 0), small = picture(generator, {5, 4}, 3, 0);
    const Memd down = with_errors(device(), large, small);
    EXPECT_EQ(down.pixels, (std::array<std::size_t, 2>{72, 20}));
    EXPECT_EQ(std::count(down.local_errors.begin(), down.local_errors.end(), -1.0F), 52);
    EXPECT_EQ(down.memd,
              std::accumulate(down.local_errors.begin(), down.local_errors.begin() + 20, 0.0) / 20);
    const Memd up = with_errors(device(), small, large);
    EXPECT_EQ(std::count(up.local_errors.begin(), up.local_errors.end(), -1.0F), 0);
    expect_equal(down, reference::memd(large, small));
    expect_equal(up, reference::memd(small, large));
}

TEST(Memd, WhiteLevelsScale) {
    std::mt19937 generator(3);
    const Image a = picture(generator, {6, 7}, 3, 0), b = picture(generator, {6, 7}, 3, 0);
    Image brighter = b;
    for (float& value : brighter.values()) value *= 4.0F;  // exact
    const Memd plain = with_errors(device(), a, b);
    expect_equal(with_errors(device(), a, brighter, {.white = {1.0, 4.0}}), plain);
    expect_equal(with_errors(device(), a, b, {.white = {3.7, 3.7}}),
                 reference::memd(a, b, {.white = {3.7, 3.7}}));
}

TEST(Memd, OrderOfBDecidesTiesOnly) {
    // Distinct distances: any order of B gives the same local errors.
    std::mt19937 generator(4);
    const Image a = picture(generator, {8, 8}, 3, 0);
    Image b = picture(generator, {8, 8}, 3, 0);
    const Memd before = with_errors(device(), a, b);
    std::vector<std::size_t> order(64);
    std::iota(order.begin(), order.end(), 0);
    std::shuffle(order.begin(), order.end(), generator);
    Image turned({8, 8}, 3);
    for (int p = 0; p < 3; ++p)
        for (std::size_t r = 0; r < 64; ++r) turned.plane(p)[r] = b.plane(p)[order[r]];
    EXPECT_EQ(with_errors(device(), a, turned).local_errors, before.local_errors);
}

TEST(Memd, ValuesSoSmallThatSquaresVanish) {
    Image a({1, 2}, 1), b({1, 3}, 1);
    a.values()[0] = 1e-30F;
    a.values()[1] = 1e-42F;
    b.values()[0] = 3e-14F;
    b.values()[1] = -1e-33F;
    b.values()[2] = 1e-30F;
    for (const Metric metric : metrics)
        expect_equal(with_errors(device(), a, b, {.metric = metric}),
                     reference::memd(a, b, {.metric = metric}));
}

TEST(Memd, RefusesWhatHasNoAnswer) {
    const auto message = [](const Image& a, const Image& b, const MemdOptions& options = {}) {
        try {
            static_cast<void>(memd(device(), a, b, options));
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string("no error");
    };
    const Image good = grey({1, 2});
    EXPECT_NE(message(good, Image({1, 2}, 3)).find("1 plane, B 3"), std::string::npos);
    EXPECT_NE(message(Image(), good).find("empty"), std::string::npos);
    EXPECT_NE(message(good, Image()).find("planes"), std::string::npos);
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                            -std::numeric_limits<float>::infinity(), 1e14F}) {
        Image image = good;
        image.values()[1] = bad;
        EXPECT_NE(message(good, image).find("column 1"), std::string::npos) << bad;
        EXPECT_NE(message(image, good).find("column 1"), std::string::npos) << bad;
    }
    for (const double white :
         {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
        EXPECT_NE(message(good, good, {.white = {white, 1.0}}).find("white"), std::string::npos) << white;
    EXPECT_THROW(static_cast<void>(metric("L2")), InputError);
    for (const Metric one : metrics) EXPECT_EQ(metric(name(one)), one);
}

TEST(Memd, OneReferenceManyCandidates) {
    std::mt19937 generator(5);
    const Image a = picture(generator, {20, 20}, 3, 0);
    MemdReference reference_of(device(), a, {.local_errors = true});
    for (const Size size : {Size{20, 20}, Size{7, 9}, Size{31, 15}}) {
        const Image b = picture(generator, size, 3, 0);
        expect_equal(reference_of(b), reference::memd(a, b));
    }
}

/// Every search that the processor can run, on every kind of picture, step by step.
TEST(Memd, EveryInstructionSet) {
    std::mt19937 generator(6);
    for (const int planes : {1, 3, 6, 31})
        for (const int levels : {0, 4})
            for (const Metric metric : metrics) {
                const Image image = picture(generator, {17, 19}, planes, levels);
                Colours colours{planes, reference::colours(image, 1.0)};
                ColourTree tree(colours, metric);
                const auto searches = colour_searches(metric, planes);
                ASSERT_FALSE(searches.empty());
                const Colours asked{planes,
                                    reference::colours(picture(generator, {17, 19}, planes, levels), 1.0)};
                for (std::size_t pixel = 0; pixel < asked.pixels(); ++pixel) {
                    const ColourTree::Hit hit = tree.nearest(asked.at(pixel));
                    for (const auto& search : searches) {
                        const ColourTree::Hit other = search(tree.arrays(), asked.at(pixel));
                        EXPECT_EQ(other.key, hit.key);
                        EXPECT_EQ(other.slot, hit.slot);
                    }
                    tree.take(hit.slot);
                }
                EXPECT_EQ(tree.left(), 0U);
            }
}

/// Boxes stay the same whichever instruction set brings them up to date, and are those of what is left.
TEST(Memd, EveryInstructionSetTightensBoxes) {
    std::mt19937 generator(7);
    for (const int planes : {1, 3, 6}) {
        const Colours colours{planes,
                              reference::colours(picture(generator, {21, 19}, planes, 0, -0.5F, 1.0F), 1.0)};
        ColourTree tree(colours, Metric::max);
        const auto updates = box_updates();
        ASSERT_FALSE(updates.empty());
        const std::size_t blocks = tree.arrays().first.size() / ColourTree::lanes;
        while (tree.left() > 0) {
            // Whole blocks empty one after the other, others lose a few.
            std::uint32_t slot = 0;
            while (tree.first(slot) == ColourTree::none) ++slot;
            tree.take(slot);
            if (tree.left() % 16 != 0) continue;
            for (const auto& update : updates) {
                ColourTreeArrays arrays = tree.arrays();
                for (std::size_t block = 0; block < blocks; ++block) {
                    EXPECT_FALSE(update(arrays, 0, block));
                    const std::size_t box = block / 16 * 32 * static_cast<std::size_t>(planes) + block % 16;
                    const float kept = arrays.boxes[box];
                    arrays.boxes[box] = -1e9F;
                    EXPECT_TRUE(update(arrays, 0, block));
                    EXPECT_EQ(arrays.boxes[box], kept);
                }
                for (std::size_t block = 0; block < (blocks + 15) / 16; ++block)
                    EXPECT_FALSE(arrays.levels() > 1 && update(arrays, 1, block));
                EXPECT_EQ(arrays.boxes, tree.arrays().boxes);
                EXPECT_EQ(arrays.lowest, tree.arrays().lowest);
            }
        }
        for (std::size_t box = 0; box < blocks; ++box) EXPECT_EQ(tree.arrays().lowest[box], ColourTree::none);
    }
}

/// Sizes from one pixel to some dozens, few and many levels, overlapping and disjoint ranges.
struct RandomCase {
    Image a, b;
    MemdOptions options;
};

RandomCase random_case(std::mt19937& generator, int largest_side, int d, Metric metric) {
    const auto pick = [&generator](int low, int high) {
        return std::uniform_int_distribution<int>(low, high)(generator);
    };
    constexpr std::array levels{0, 0, 1, 2, 3, 8, 256};
    const auto level = [&] { return levels[static_cast<std::size_t>(pick(0, 6))]; };
    const auto size = [&] { return Size{pick(1, largest_side), pick(1, largest_side)}; };
    const float shift = pick(0, 2) == 0 ? 0.6F : 0.0F;
    RandomCase result;
    result.a = picture(generator, size(), d, level(), 0.0F, 1.0F - shift);
    result.b = picture(generator, pick(0, 1) == 0 ? size() : result.a.size(), d, level(), shift, 1.0F);
    result.options.metric = metric;
    return result;
}

/// Any number of planes and any metric.
RandomCase random_case(std::mt19937& generator, int largest_side) {
    constexpr std::array planes{1, 1, 2, 3, 3, 3, 4, 6, 31};
    const int d = planes[std::uniform_int_distribution<std::size_t>(0, planes.size() - 1)(generator)];
    const Metric metric = metrics[std::uniform_int_distribution<std::size_t>(0, 2)(generator)];
    return random_case(generator, largest_side, d, metric);
}

/// The greedy loop cut up as told, so that small pictures too are searched on the device.
Memd in_blocks(Device& on, const RandomCase& one, const MemdBlocks& blocks, std::size_t& searched_on_host) {
    const Colours a{one.a.planes(), reference::colours(one.a, 1.0)};
    ColourTree tree({one.b.planes(), reference::colours(one.b, 1.0)}, one.options.metric);
    Memd result;
    result.pixels = {area(one.a.size()), area(one.b.size())};
    result.local_errors.assign(a.pixels(), -1.0F);
    double sum = 0.0;
    std::size_t count = 0;
    searched_on_host =
        take_all(on.impl(), a, on.impl().upload(a.values), tree, one.options.metric, blocks,
                 [&](std::size_t pixel, ColourKey key) {
                     EXPECT_EQ(pixel, count++);
                     const auto found =
                         static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(key >> 32)));
                     const double error = one.options.metric == Metric::l2 ? std::sqrt(found) : found;
                     sum += error;
                     result.local_errors[pixel] = static_cast<float>(error);
                 });
    result.memd = sum / static_cast<double>(count);
    return result;
}

/// Planes and metrics that kernels are built for.
using Kernels = std::vector<std::pair<int, Metric>>;

/// Colours are read where they lie, or from tiles of a few blocks.
constexpr std::array tiles{0, 2};

void compare_blocks(Device& on, const Kernels& kernels, unsigned seed, int cases, int largest_side,
                    int tile) {
    std::mt19937 generator(seed);
    std::size_t pixels = 0, on_host = 0;
    for (int k = 0; k < cases; ++k) {
        const auto& [planes, metric] = kernels[static_cast<std::size_t>(k) % kernels.size()];
        const RandomCase one = random_case(generator, largest_side, planes, metric);
        MemdBlocks blocks;
        blocks.candidates = 4;
        blocks.smallest = std::size_t{1} << (k % 6);
        blocks.largest = 64;
        blocks.parts = 6;
        blocks.hopeless = 2.0;  // never gives up
        blocks.tile = tile;
        std::size_t searched = 0;
        const Memd found = in_blocks(on, one, blocks, searched);
        const Memd expected = reference::memd(one.a, one.b, one.options);
        pixels += std::min(expected.pixels[0], expected.pixels[1]);
        on_host += searched;
        ASSERT_EQ(found.memd, expected.memd) << "case " << k << " of seed " << seed << ": " << one.a.planes()
                                             << " planes, " << test::text(one.a.size()) << " against "
                                             << test::text(one.b.size()) << ", " << name(one.options.metric);
        ASSERT_EQ(found.local_errors, expected.local_errors) << "case " << k << " of seed " << seed;
    }
    // The device must have found most of them, or this tests the host alone.
    EXPECT_LT(on_host, pixels / 2);
}

void compare_random_cases(Device& on, unsigned seed, int cases, int largest_side) {
    std::mt19937 generator(seed);
    for (int k = 0; k < cases; ++k) {
        const RandomCase one = random_case(generator, largest_side);
        const Memd found = with_errors(on, one.a, one.b, one.options);
        const Memd expected = reference::memd(one.a, one.b, one.options);
        ASSERT_EQ(found.memd, expected.memd) << "case " << k << " of seed " << seed << ": " << one.a.planes()
                                             << " planes, " << test::text(one.a.size()) << " against "
                                             << test::text(one.b.size()) << ", " << name(one.options.metric);
        ASSERT_EQ(found.local_errors, expected.local_errors) << "case " << k << " of seed " << seed;
    }
}

TEST(Memd, RandomPictures) {
    compare_random_cases(device(), 1, 100, 12);
}

TEST(Memd, BlocksAtEveryWidth) {
    for (const int width : test::vector_widths)
        for (const int tile : tiles) {
            SCOPED_TRACE("width " + std::to_string(width) + ", tile " + std::to_string(tile));
            Device on = test::device_of_width(width);
            compare_blocks(on, {{3, Metric::max}, {1, Metric::l2}, {4, Metric::l1}},
                           50U + static_cast<unsigned>(width), 30, 20, tile);
        }
}

/// A tile that local memory cannot hold is halved until it does.
TEST(Memd, TilesThatDoNotFit) {
    Device on;
    std::mt19937 generator(11);
    for (const int planes : {1, 3}) {
        const RandomCase one = random_case(generator, 20, planes, Metric::l1);
        MemdBlocks blocks;
        blocks.tile = 1 << 20;
        blocks.smallest = 8;
        blocks.hopeless = 2.0;
        std::size_t searched = 0;
        expect_equal(in_blocks(on, one, blocks, searched), reference::memd(one.a, one.b, one.options));
    }
}

TEST(Memd, EverySearchOnPictures) {
    std::mt19937 generator(8);
    const RandomCase one{picture(generator, {40, 31}, 3, 0), picture(generator, {37, 33}, 3, 20), {}};
    const Memd expected = reference::memd(one.a, one.b);
    for (const MemdSearch search : {MemdSearch::automatic, MemdSearch::host_tree, MemdSearch::exhaustive}) {
        Device on;
        expect_equal(with_errors(on, one.a, one.b, {.search = search}), expected);
        // The device searches when it is asked to, and a CPU only then.
        EXPECT_EQ(on.launch_count() > 0, search == MemdSearch::exhaustive) << static_cast<int>(search);
    }
}

TEST(Memd, SearchFollowsDeviceAndPictures) {
    Device on;
    const auto choice = [&](std::size_t pixels, std::size_t colours) {
        return chosen_search(on.impl(), MemdSearch::automatic, pixels, colours);
    };
    const bool cpu = on.info().type == DeviceType::cpu;
    EXPECT_EQ(choice(100, 100), MemdSearch::host_tree);
    EXPECT_EQ(choice(1000000, 100), cpu ? MemdSearch::host_tree : MemdSearch::exhaustive);
    EXPECT_EQ(choice(1000000, 1000000), MemdSearch::host_tree);
    EXPECT_EQ(chosen_search(on.impl(), MemdSearch::exhaustive, 1, 1), MemdSearch::exhaustive);
}

/// What Oclgrind runs: every kernel, several blocks, a tail.
TEST(MemdSmall, EveryKernel) {
    std::mt19937 generator(9);
    const RandomCase one{picture(generator, {5, 9}, 3, 0), picture(generator, {7, 5}, 3, 9), {}};
    for (const int tile : tiles) {
        MemdBlocks blocks;
        blocks.smallest = 16;
        blocks.largest = 20;
        blocks.hopeless = 2.0;
        blocks.tile = tile;
        std::size_t searched = 0;
        expect_equal(in_blocks(device(), one, blocks, searched), reference::memd(one.a, one.b));
    }
}

TEST(MemdLong, TenThousandRandomPictures) {
    compare_random_cases(device(), 2, 8000, 13);
    for (const int width : test::vector_widths)
        for (const int tile : tiles) {
            SCOPED_TRACE("width " + std::to_string(width) + ", tile " + std::to_string(tile));
            Device on = test::device_of_width(width);
            compare_blocks(
                on, {{1, Metric::l1}, {3, Metric::max}, {3, Metric::l2}, {6, Metric::l1}, {31, Metric::l2}},
                300U + static_cast<unsigned>(width), 300, 20, tile);
            compare_blocks(on, {{3, Metric::max}}, 400U + static_cast<unsigned>(width), 40, 60, tile);
        }
}

TEST(MemdLong, RealPictures) {
    const Image cork = read_picture(test::data_folder() + "/cork.png", Crop{0, 0, 96, 96}).image;
    const Image rock = read_picture(test::data_folder() + "/rock.png", Crop{0, 0, 96, 96}).image;
    const Image xyz = read_picture(test::data_folder() + "/cork-xyz.exr").image;
    for (const Metric metric : metrics) {
        expect_equal(with_errors(device(), cork, rock, {.metric = metric}),
                     reference::memd(cork, rock, {.metric = metric}));
    }
    const Image half = xyz.crop(0, 0, {std::min(96, xyz.height()), std::min(96, xyz.width())});
    expect_equal(with_errors(device(), half, cork, {.white = {0.5, 1.0}}),
                 reference::memd(half, cork, {.white = {0.5, 1.0}}));
}

}  // namespace
}  // namespace btfield
