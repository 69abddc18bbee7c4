// host/relief/height.cpp, host/relief/fourier_basis.cpp and kernels/relief/height.cl.

#include "btfield/height.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "tests/device_cases.hpp"
#include "tests/reference/height.hpp"

namespace btfield {
namespace {

using std::size_t;

constexpr SurfaceEdges both_edges[] = {SurfaceEdges::mirror, SurfaceEdges::periodic};

double largest(std::span<const float> values) {
    double most = 0.0;
    for (const float value : values) most = std::max(most, std::abs(static_cast<double>(value)));
    return most;
}

/// Largest error of a height from slopes of this size: those of two transforms, each 2u (4 + log2 N) ‖y‖
/// (tests/cl/fft_test.cpp), of a right side whose sums round three times, divided by the least λ that is no
/// zero, sin²(π/n) of the longer side. Values, not norms: ‖y‖ = √N largest; Parseval takes √N back.
double bound(Size size, double slope, double weight = 0.0, double base = 0.0) {
    const int longest = std::max(size.height, size.width);
    const double s = std::sin(std::numbers::pi / std::max(2, longest));
    const double rounding =
        test::unit_roundoff * (4.0 * (4.0 + std::log2(static_cast<double>(area(size)))) + 6.0);
    return rounding * (2.0 * slope + weight * base) * 2.0 / (s * s + weight) + test::unit_roundoff * base;
}

void expect_reference(Device& device, Size size, SurfaceEdges edges, const IntegrationOptions& like = {}) {
    SCOPED_TRACE(test::text(size) + (edges == SurfaceEdges::mirror ? ", mirror" : ", periodic"));
    const Image slopes = test::random_image(size, 2, 0.1F, 5);
    IntegrationOptions options = like;
    options.edges = edges;
    double weight = 0.0, base = 0.0;
    if (options.coarse) {
        options.coarse->height = test::random_image(size, 1, 3.0F, 6);
        weight = std::pow(std::sin(2.0 * std::numbers::pi / options.coarse->wavelength), 2);
        base = largest(options.coarse->height.values());
    }
    const Image height = integrate(device, slopes, options);
    ASSERT_EQ(height.size(), size);
    ASSERT_EQ(height.planes(), 1);
    const std::vector<double> expected =
        reference::height(slopes, edges, options.coarse ? &*options.coarse : nullptr);
    const double tolerance = bound(size, largest(slopes.values()), weight, base);
    for (size_t i = 0; i < expected.size(); ++i)
        ASSERT_LE(std::abs(static_cast<double>(height.values()[i]) - expected[i]), tolerance)
            << "pixel " << i;
}

class HeightSmall : public testing::TestWithParam<int> {
  protected:
    Device device_ = test::device_of_width(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Widths, HeightSmall, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(HeightSmall, FollowsTheFormula) {
    for (const SurfaceEdges edges : both_edges) expect_reference(device_, {16, 40}, edges);
}

class HeightWidths : public HeightSmall {};
INSTANTIATE_TEST_SUITE_P(Widths, HeightWidths, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(HeightWidths, EverySize) {
    for (const Size size : test::lattice_sizes)
        for (const SurfaceEdges edges : both_edges) expect_reference(device_, size, edges);
}

TEST_P(HeightWidths, CoarseHeights) {
    IntegrationOptions options;
    options.coarse = CoarseHeight{{}, 16.0};
    for (const Size size : {Size{1, 1}, Size{7, 4}, Size{33, 20}, Size{17, 31}})
        for (const SurfaceEdges edges : both_edges) expect_reference(device_, size, edges, options);
}

/// Waves along both axes, of several lengths.
Image hills(Size size, double pitch = 1.0) {
    Image height(size, 1);
    for (int r = 0; r < size.height; ++r)
        for (int c = 0; c < size.width; ++c) {
            const double x = 2.0 * std::numbers::pi * c / size.width,
                         y = 2.0 * std::numbers::pi * r / size.height;
            height.at(0, r, c) =
                static_cast<float>(pitch * (5.0 * std::cos(x + 2.0 * y) + 2.0 * std::sin(3.0 * x - y) +
                                            std::cos(4.0 * x + 5.0 * y)));
        }
    return height;
}

double range_of(const Image& image) {
    const auto [low, high] = std::ranges::minmax(image.values());
    return static_cast<double>(high) - static_cast<double>(low);
}

double largest_difference(const Image& a, const Image& b) {
    double most = 0.0;
    for (size_t i = 0; i < a.values().size(); ++i)
        most =
            std::max(most, std::abs(static_cast<double>(a.values()[i]) - static_cast<double>(b.values()[i])));
    return most;
}

Image centred(Image image) {
    double sum = 0.0;
    for (const float value : image.values()) sum += static_cast<double>(value);
    for (float& value : image.values())
        value -= static_cast<float>(sum / static_cast<double>(image.values().size()));
    return image;
}

TEST(Height, SlopesAndBack) {
    // 1e-4 of the range is what users are promised; 97 and 101 have no fast transform.
    for (const Size size : {Size{128, 128}, Size{97, 101}, Size{256, 60}, Size{101, 64}})
        for (const SurfaceEdges edges : both_edges) {
            SCOPED_TRACE(test::text(size));
            const Image height = centred(hills(size));
            IntegrationOptions options;
            options.edges = edges;
            const Image back = integrate(test::default_device(), slopes_of_height(height, edges), options);
            EXPECT_LE(largest_difference(back, height), 1e-4 * range_of(height));
        }
}

TEST(Height, MirroredHeightsKeepTheirSlope) {
    // Not periodic: the torus would tear it.
    Image height({40, 64}, 1);
    for (int r = 0; r < 40; ++r)
        for (int c = 0; c < 64; ++c)
            height.at(0, r, c) = 0.5F * static_cast<float>(c) - 0.25F * static_cast<float>(r);
    const Image slopes = slopes_of_height(height, SurfaceEdges::mirror);
    const Image back = integrate(test::default_device(), slopes);
    EXPECT_LE(largest_difference(back, centred(height)), 1e-4 * range_of(height));
    IntegrationOptions flat;
    flat.flattening = Flattening::plane;
    // What is left of a plane: the same error.
    EXPECT_LE(range_of(integrate(test::default_device(), slopes, flat)), 2e-4 * range_of(height));
}

TEST(Height, PeriodicSlopesGiveAHeightThatTiles) {
    // White slopes are no height's; what is found still tiles: steps across the wrap are like those inside.
    const Size size{120, 96};
    IntegrationOptions options;
    options.edges = SurfaceEdges::periodic;
    const Image height = integrate(test::default_device(), test::random_image(size, 2), options);
    double across = 0.0, inside = 0.0;
    for (int r = 0; r < size.height; ++r)
        for (int c = 0; c < size.width; ++c) {
            const double step = std::abs(static_cast<double>(height.at(0, r, c)) -
                                         static_cast<double>(height.at(0, r, (c + 1) % size.width)));
            (c + 1 == size.width ? across : inside) += step;
        }
    across /= size.height;
    inside /= size.height * (size.width - 1.0);
    // 120 steps scatter by 1/√120 of themselves or so; 4 of these.
    EXPECT_NEAR(across / inside, 1.0, 4.0 / std::sqrt(120.0));
}

TEST(Height, LowWavesGo) {
    // A bowl under short waves: the bowl is flattened, the waves stay.
    const Size size{96, 96};
    for (const SurfaceEdges edges : both_edges) {
        Image bowl(size, 1), waves(size, 1);
        for (int r = 0; r < size.height; ++r)
            for (int c = 0; c < size.width; ++c) {
                bowl.at(0, r, c) =
                    static_cast<float>(40.0 * std::cos(2.0 * std::numbers::pi * (c + 0.5) / 96.0));
                waves.at(0, r, c) = static_cast<float>(std::cos(2.0 * std::numbers::pi * (r + 0.5) / 12.0));
            }
        Image both = bowl;
        for (size_t i = 0; i < both.values().size(); ++i) both.values()[i] += waves.values()[i];
        IntegrationOptions options;
        options.edges = edges;
        options.flattening = Flattening::low;
        const Image height = integrate(test::default_device(), slopes_of_height(both, edges), options);
        // The bowl's wave is as long as the side: half of it is left by definition.
        Image expected = waves;
        for (size_t i = 0; i < expected.values().size(); ++i) expected.values()[i] += 0.5F * bowl.values()[i];
        EXPECT_LE(largest_difference(height, expected), 0.01 * range_of(bowl));
    }
}

TEST(Height, ACoarseHeightDecidesInTheLarge) {
    const Size size{128, 128};
    const Image truth = centred(hills(size));
    // Slopes with a slope of all in them that is wrong, coarse heights with noise in them: both are mended.
    Image slopes = slopes_of_height(truth, SurfaceEdges::mirror);
    for (float& value : slopes.plane(0)) value += 0.1F;
    Image noisy = truth;
    const Image noise = test::random_image(size, 1);
    for (size_t i = 0; i < noisy.values().size(); ++i) noisy.values()[i] += noise.values()[i];
    IntegrationOptions options;
    options.coarse = CoarseHeight{noisy, 64.0};
    const Image fused = integrate(test::default_device(), slopes, options);
    const Image alone = integrate(test::default_device(), slopes);
    const auto deviation = [&](const Image& height) {
        double squares = 0.0;
        for (size_t i = 0; i < height.values().size(); ++i)
            squares += std::pow(static_cast<double>(height.values()[i] - truth.values()[i]), 2);
        return std::sqrt(squares / static_cast<double>(height.values().size()));
    };
    // Of noise the long waves stay, of the slope what lies within a wavelength of the edges.
    EXPECT_LE(deviation(fused), 0.4 * deviation(noisy));
    EXPECT_LE(deviation(fused), 0.2 * deviation(alone));
}

TEST(Height, NoiseOfMeasuredNormalsDoesNotAlternate) {
    for (const SurfaceEdges edges : both_edges) {
        const Size size{64, 96};
        const Image truth = centred(hills(size));
        Image slopes = slopes_of_height(truth, edges);
        const Image noise = test::random_image(size, 2);
        for (size_t i = 0; i < slopes.values().size(); ++i) slopes.values()[i] += 0.2F * noise.values()[i];
        IntegrationOptions options;
        options.edges = edges;
        const Image plain = integrate(test::default_device(), slopes, options);
        options.measured = true;
        const Image measured = integrate(test::default_device(), slopes, options);
        // What alternates along columns, against what lies between.
        const auto alternating = [&](const Image& height) {
            double sum = 0.0;
            for (int r = 0; r < size.height; ++r)
                for (int c = 1; c + 1 < size.width; ++c) {
                    const double bend = static_cast<double>(height.at(0, r, c - 1)) + height.at(0, r, c + 1) -
                                        2.0 * static_cast<double>(height.at(0, r, c));
                    sum += bend * bend;
                }
            return sum;
        };
        EXPECT_LE(alternating(measured), 0.5 * alternating(plain));
        // Long waves stay, but for where mirrors bend them.
        const Image clean = integrate(test::default_device(), slopes_of_height(truth, edges), options);
        EXPECT_LE(largest_difference(clean, truth), 5e-3 * range_of(truth));
    }
}

TEST(Height, ScaleOfAHeightMap) {
    const Image height = hills({64, 80});
    for (const SurfaceEdges edges : both_edges) {
        const Image slopes = slopes_of_height(hills({64, 80}, 12.5), edges);
        EXPECT_NEAR(height_scale(slopes, height, edges), 12.5, 1e-4);
    }
    EXPECT_EQ(height_scale(Image({8, 8}, 2), Image({8, 8}, 1), SurfaceEdges::mirror), 0.0);
}

TEST(Height, NormalsPointAgainstTheSlope) {
    // Rises to the right by 1, downwards by 2: the normal leans left and up.
    Image slopes({1, 1}, 2);
    slopes.at(0, 0, 0) = 1.0F;
    slopes.at(1, 0, 0) = 2.0F;
    const Image normals = normals_of_slopes(slopes);
    const float z = 1.0F / std::sqrt(6.0F);
    EXPECT_FLOAT_EQ(normals.at(0, 0, 0), -z);
    EXPECT_FLOAT_EQ(normals.at(1, 0, 0), 2.0F * z);
    EXPECT_FLOAT_EQ(normals.at(2, 0, 0), z);
    const SlopeField back = slopes_of_normals(normals);
    EXPECT_NEAR(back.slopes.at(0, 0, 0), 1.0F, 1e-6F);
    EXPECT_NEAR(back.slopes.at(1, 0, 0), 2.0F, 1e-6F);
    EXPECT_EQ(back.cut, 0U);
}

TEST(Height, NormalsFromBehindAreCut) {
    Image normals({1, 4}, 3);
    normals.at(2, 0, 0) = -1.0F;                              // straight away: level
    normals.at(0, 0, 1) = 1.0F;                               // in the plane
    normals.at(0, 0, 2) = 0.6F, normals.at(2, 0, 2) = -0.8F;  // away
    const SlopeField field = slopes_of_normals(normals);      // the last has no length
    EXPECT_EQ(field.cut, 3U);
    EXPECT_EQ(field.slopes.at(0, 0, 0), 0.0F);
    for (const int c : {1, 2})
        EXPECT_NEAR(field.slopes.at(0, 0, c), -std::tan(86.0 / 180.0 * std::numbers::pi), 0.01);
    EXPECT_EQ(field.slopes.at(0, 0, 3), 0.0F);
    EXPECT_EQ(field.slopes.at(1, 0, 3), 0.0F);
}

TEST(Height, NormalMapsAreCodedAndDecoded) {
    const Image normals = normals_of_slopes(test::random_image({9, 7}, 2));
    for (const NormalConvention convention : {NormalConvention::opengl, NormalConvention::directx}) {
        const Image map = encode_normals(normals, convention);
        for (const float value : map.values()) {
            EXPECT_GE(value, 0.0F);
            EXPECT_LE(value, 1.0F);
        }
        // Whole numbers, and floats that are coded like them.
        for (const PixelType type :
             {PixelType::uint8, PixelType::uint16, PixelType::half, PixelType::float32}) {
            Picture picture;
            picture.image = map;
            picture.type = type;
            EXPECT_LE(largest_difference(decode_normals(picture, convention), normals), 1e-6);
        }
    }
    Picture floats;
    floats.image = normals;
    floats.type = PixelType::float32;
    EXPECT_LE(largest_difference(decode_normals(floats), normals), 1e-6);
    const Image up = encode_normals(normals), down = encode_normals(normals, NormalConvention::directx);
    for (size_t i = 0; i < 63; ++i) EXPECT_NEAR(up.plane(1)[i], 1.0F - down.plane(1)[i], 1e-6F);
    // A flat map of floats is (0, 0, 1) or (0.5, 0.5, 1).
    Picture flat;
    flat.type = PixelType::half;
    flat.image = Image({2, 2}, 3);
    std::ranges::fill(flat.image.plane(2), 1.0F);
    EXPECT_EQ(decode_normals(flat).at(2, 1, 1), 1.0F);
    std::ranges::fill(flat.image.plane(0), 0.5F);
    std::ranges::fill(flat.image.plane(1), 0.5F);
    EXPECT_EQ(decode_normals(flat).at(2, 1, 1), 1.0F);
    EXPECT_EQ(decode_normals(flat).at(0, 1, 1), 0.0F);
}

TEST(Height, CodedHeights) {
    Image height({1, 3}, 1);
    height.at(0, 0, 0) = -2.0F;
    height.at(0, 0, 2) = 5.0F;
    const double scale = encoded_height_scale(height);
    const Image coded = encode_height(height, scale);
    EXPECT_NEAR(coded.at(0, 0, 2), 1.0F, 1e-6F);
    EXPECT_EQ(std::lround(65535.0F * coded.at(0, 0, 1)), 32768);
    EXPECT_NEAR((static_cast<double>(coded.at(0, 0, 0)) - mid_grey) * scale, -2.0, 1e-5);
    EXPECT_GT(encoded_height_scale(Image({2, 2}, 1)), 0.0);
    EXPECT_THROW((void)encode_height(height, 0.0), InputError);
}

TEST(Height, WhatCannotBeIntegratedIsRefused) {
    Device& device = test::default_device();
    const Image slopes({4, 5}, 2);
    EXPECT_THROW((void)integrate(device, Image({4, 5}, 3)), InputError);
    Image bad = slopes;
    bad.at(1, 2, 3) = std::numeric_limits<float>::quiet_NaN();
    EXPECT_THROW((void)integrate(device, bad), InputError);
    IntegrationOptions options;
    for (const Image& coarse : {Image({5, 4}, 1), Image({4, 5}, 3)}) {
        options.coarse = CoarseHeight{coarse, 64.0};
        EXPECT_THROW((void)integrate(device, slopes, options), InputError);
    }
    for (const double wavelength : {0.0, 3.9, std::numeric_limits<double>::quiet_NaN()}) {
        options.coarse = CoarseHeight{Image({4, 5}, 1), wavelength};
        EXPECT_THROW((void)integrate(device, slopes, options), InputError);
    }
    EXPECT_THROW((void)slopes_of_normals(slopes), InputError);
    EXPECT_THROW((void)slopes_of_height(slopes, SurfaceEdges::mirror), InputError);
    EXPECT_THROW((void)normals_of_slopes(Image({4, 5}, 1)), InputError);
    EXPECT_THROW((void)height_scale(slopes, Image({5, 4}, 1), SurfaceEdges::mirror), InputError);
    Picture picture;
    picture.image = Image({4, 5}, 3);  // all normals (−1, −1, −1)
    EXPECT_THROW((void)decode_normals(picture), InputError);
    picture.image = Image({4, 5}, 1);
    EXPECT_THROW((void)decode_normals(picture), InputError);
}

}  // namespace
}  // namespace btfield
