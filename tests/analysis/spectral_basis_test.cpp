#include "btfield/spectral_basis.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/analysis/lag_products.hpp"
#include "tests/device_cases.hpp"
#include "tests/places.hpp"
#include "tests/reference/lag_covariance.hpp"

namespace btfield {

using namespace detail;

namespace {

/// Planes that correlate, with means of their own.
Image correlated(Size size, int planes) {
    Image image = test::random_image(size, planes, 0.0F, 3);
    for (int p = 1; p < planes; ++p)
        for (std::size_t k = 0; k < area(size); ++k)
            image.plane(p)[k] = 0.7F * image.plane(p - 1)[k] + 0.3F * image.plane(p)[k] + 0.1F;
    return image;
}

double largest(const Image& image) {
    double most = 0.0;
    for (const float value : image.values()) most = std::max(most, std::abs(static_cast<double>(value)));
    return most;
}

/// Eigenplanes are uncorrelated, ordered, of mean 0, and come back.
void check_basis(const Image& image, int rank) {
    const SpectralBasis basis = spectral_basis(image);
    EXPECT_NO_THROW(check(basis));
    ASSERT_EQ(basis.planes, image.planes());
    ASSERT_EQ(basis.rank, rank);
    const auto d = static_cast<std::size_t>(basis.planes);
    for (std::size_t j = 0; j < static_cast<std::size_t>(rank); ++j) {
        const auto row = std::span(basis.matrix).subspan(j * d, d);
        const double most = *std::ranges::max_element(row, {}, [](double t) { return std::abs(t); });
        // Components that rounding cannot tell apart: the first of them decides.
        const auto deciding =
            std::ranges::find_if(row, [&](double t) { return std::abs(t) >= std::abs(most) * (1.0 - 1e-9); });
        EXPECT_GT(*deciding, 0.0) << "eigenvector " << j;
    }
    const Image planes = to_eigenplanes(basis, image);
    const double most = largest(image), rounding = std::numeric_limits<float>::epsilon();
    double before = std::numeric_limits<double>::infinity();
    for (int i = 0; i < rank; ++i) {
        // Storing as float32 leaves a relative u of values up to √d of the picture's largest.
        const double error = 2.0 * std::sqrt(static_cast<double>(d)) * most * rounding;
        EXPECT_LE(std::abs(reference::mean(planes, i)), error);
        const double variance = reference::lag_covariance(planes, i, i, {0, 0});
        const double deviation = std::sqrt(variance);
        EXPECT_LE(variance, before + 2.0 * error * deviation);
        before = variance;
        for (int j = 0; j < i; ++j) {
            const double other = std::sqrt(reference::lag_covariance(planes, j, j, {0, 0}));
            EXPECT_LE(std::abs(reference::lag_covariance(planes, i, j, {0, 0})),
                      error * (other + deviation) + 1e-12 * other * other);
        }
    }
    // What has no eigenplane has a deviation of at most 1e-6 of the largest; a pixel may stray by √(its
    // number) of it.
    const Image back = from_eigenplanes(basis, planes, image.space());
    ASSERT_EQ(back.planes(), image.planes());
    EXPECT_EQ(back.space(), image.space());
    for (std::size_t k = 0; k < back.values().size(); ++k)
        ASSERT_LE(std::abs(static_cast<double>(back.values()[k]) - static_cast<double>(image.values()[k])),
                  4.0 * static_cast<double>(d) * most * rounding);
}

TEST(SpectralBasis, DiagonalisesTheCovariance) {
    for (const int planes : {1, 2, 3, 4, 8, 31}) {
        SCOPED_TRACE(std::to_string(planes) + " planes");
        for (const Size size : {Size{16, 16}, Size{33, 47}}) check_basis(correlated(size, planes), planes);
    }
}

TEST(SpectralBasis, RealPictures) {
    for (const auto& [name, rank] :
         {std::pair{"cork.png", 3}, std::pair{"bark.png", 3}, std::pair{"rock.png", 1},
          std::pair{"grass.png", 1}, std::pair{"landsat.tif", 6}, std::pair{"cork-xyz.exr", 3}}) {
        SCOPED_TRACE(name);
        check_basis(read_picture(test::data_folder() + "/" + name).image, rank);
    }
}

TEST(SpectralBasis, PlanesThatRepeatOrCombineOthersHaveNoEigenplane) {
    const Image source = correlated({24, 20}, 2);
    Image image(source.size(), 5);
    for (std::size_t k = 0; k < area(source.size()); ++k) {
        const float a = source.plane(0)[k], b = source.plane(1)[k];
        const float values[] = {a, b, a, 0.5F, 0.5F * (a + b)};
        for (int p = 0; p < 5; ++p) image.plane(p)[k] = values[p];
    }
    check_basis(image, 2);
    Image grey(source.size(), 3);
    for (int p = 0; p < 3; ++p) std::ranges::copy(source.plane(0), grey.plane(p).begin());
    check_basis(grey, 1);
    const SpectralBasis basis = spectral_basis(grey);
    for (const double t : basis.matrix) EXPECT_LE(std::abs(t - 1.0 / std::sqrt(3.0)), 1e-12);
}

TEST(SpectralBasis, SignsDoNotDependOnTheOrderOfPlanes) {
    const Image image = correlated({24, 20}, 3);
    Image turned_round(image.size(), 3);
    for (int p = 0; p < 3; ++p) std::ranges::copy(image.plane(2 - p), turned_round.plane(p).begin());
    const SpectralBasis a = spectral_basis(image), b = spectral_basis(turned_round);
    for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t i = 0; i < 3; ++i)
            EXPECT_LE(std::abs(a.matrix[3 * j + i] - b.matrix[3 * j + 2 - i]), 1e-9);
}

TEST(SpectralBasis, TurnedStatisticIsThatOfTheEigenplanes) {
    for (const int repeated : {0, 1}) {
        Image image = correlated({21, 18}, 3);
        if (repeated == 1) std::ranges::copy(std::as_const(image).plane(0), image.plane(1).begin());
        const SpectralBasis basis = spectral_basis(image);
        ASSERT_EQ(basis.rank, 3 - repeated);
        const Image planes = to_eigenplanes(basis, image);
        const LagCovariance found = turned(basis, lag_covariance(image, {2, 3}));
        ASSERT_EQ(found.planes(), basis.rank);
        // float32 eigenplanes of values up to about 8: u · 8 · deviation (about 2), twice.
        const double bound = 2.0 * 16.0 * test::unit_roundoff;
        std::vector<double> blocks;
        std::vector<Offset> lags;
        for (int row = -2; row <= 2; ++row)
            for (int column = -3; column <= 3; ++column) {
                lags.push_back({row, column});
                for (int i = 0; i < basis.rank; ++i)
                    for (int j = 0; j < basis.rank; ++j) {
                        blocks.push_back(found(i, j, {row, column}));
                        EXPECT_LE(
                            std::abs(blocks.back() - reference::lag_covariance(planes, i, j, {row, column})),
                            bound);
                    }
            }
        for (int i = 0; i < basis.rank; ++i)
            EXPECT_LE(std::abs(found.mean()[static_cast<std::size_t>(i)]), 1e-12);
        // And back: what has no eigenplane has no variance either.
        const std::vector<double> expected = covariances_at(image, lags);
        const std::vector<double> back = turned_back(basis, blocks);
        ASSERT_EQ(back.size(), expected.size());
        for (std::size_t k = 0; k < back.size(); ++k) EXPECT_LE(std::abs(back[k] - expected[k]), 1e-11);
    }
}

TEST(SpectralBasis, TakesUnitsOfUnlikePlanesAway) {
    Image image = correlated({40, 50}, 4);
    const SpectralBasis plain = spectral_basis(image);
    ASSERT_EQ(plain.scale.size(), 4U);
    const std::array<double, 4> units{1.0, 1e-6, 634.0, 2e4};
    Image other = image;
    for (int p = 0; p < 4; ++p)
        for (float& v : other.plane(p))
            v = static_cast<float>(units[static_cast<std::size_t>(p)] * static_cast<double>(v));
    const SpectralBasis basis = spectral_basis(other);
    EXPECT_EQ(basis.rank, 4);
    for (std::size_t p = 0; p < 4; ++p) EXPECT_NEAR(basis.scale[p] / plain.scale[p] / units[p], 1.0, 1e-6);
    const Image a = to_eigenplanes(plain, image), b = to_eigenplanes(basis, other);
    for (std::size_t n = 0; n < a.values().size(); ++n) ASSERT_NEAR(a.values()[n], b.values()[n], 1e-4F);
    const Image back = from_eigenplanes(basis, b, ColourSpace::unspecified);
    for (int p = 0; p < 4; ++p)
        for (std::size_t n = 0; n < area(back.size()); ++n)
            ASSERT_NEAR(back.plane(p)[n] / units[static_cast<std::size_t>(p)],
                        other.plane(p)[n] / units[static_cast<std::size_t>(p)], 1e-5);
    // Colours keep their proportions.
    Image colour = correlated({40, 50}, 3);
    colour.set_space(ColourSpace::srgb);
    EXPECT_TRUE(spectral_basis(colour).scale.empty());
}

TEST(SpectralBasis, NamesMakePlanesOneKind) {
    Image image = correlated({20, 20}, 6);
    for (float& v : image.plane(1)) v *= 3.0F;
    for (float& v : image.plane(3)) v *= 1000.0F;
    image.set_names({"diffuse.R", "diffuse.G", "diffuse.B", "height", "450nm", "550nm"});
    const std::vector<double> scale = spectral_basis(image).scale;
    EXPECT_EQ(scale[0], scale[1]);
    EXPECT_EQ(scale[0], scale[2]);
    EXPECT_NE(scale[0], scale[3]);
    EXPECT_EQ(scale[4], scale[5]);
    EXPECT_NE(scale[4], scale[0]);
    image.set_names({"400nm", "450nm", "500nm", "550nm", "600nm", "650nm"});
    EXPECT_TRUE(spectral_basis(image).scale.empty());
}

TEST(SpectralBasis, VaryingPlanesLeaveConstantOnesOut) {
    Image image = correlated({20, 20}, 3);
    image.set_space(ColourSpace::linear);
    EXPECT_EQ(varying_planes(image).planes, 0);
    std::ranges::fill(image.plane(1), 7.0F);
    const SpectralBasis basis = varying_planes(image);
    EXPECT_EQ(basis.rank, 2);
    EXPECT_EQ(basis.matrix, (std::vector<double>{1, 0, 0, 0, 0, 1}));
    EXPECT_TRUE(basis.scale.empty());
    const Image back = from_eigenplanes(basis, to_eigenplanes(basis, image), ColourSpace::linear);
    for (std::size_t n = 0; n < back.values().size(); ++n)
        ASSERT_NEAR(back.values()[n], image.values()[n], 1e-6F);
    image.set_space(ColourSpace::unspecified);
    EXPECT_EQ(varying_planes(image).scale.size(), 3U);
}

TEST(SpectralBasis, RefusesPicturesWithoutOne) {
    EXPECT_THROW((void)spectral_basis(Image()), InputError);
    Image constant({8, 8}, 3);
    EXPECT_THROW((void)spectral_basis(constant), InputError);
    for (int p = 0; p < 3; ++p) std::ranges::fill(constant.plane(p), 0.1F * static_cast<float>(p + 1));
    EXPECT_THROW((void)spectral_basis(constant), InputError);
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        Image image = correlated({8, 8}, 2);
        image.at(1, 3, 4) = bad;
        EXPECT_THROW((void)spectral_basis(image), InputError);
    }
}

TEST(SpectralBasis, RefusesWhatDoesNotBelongTogether) {
    const SpectralBasis basis = spectral_basis(correlated({8, 8}, 3));
    EXPECT_THROW((void)to_eigenplanes(basis, Image({8, 8}, 2)), InputError);
    EXPECT_THROW((void)from_eigenplanes(basis, Image({8, 8}, 2), ColourSpace::srgb), InputError);
    EXPECT_THROW((void)turned(basis, LagCovariance(2, {8, 8}, {1, 1})), InputError);
    EXPECT_THROW((void)turned_back(basis, std::vector<double>(10)), InputError);
}

TEST(SpectralBasis, CheckNamesDefects) {
    const SpectralBasis good = spectral_basis(correlated({8, 8}, 3));
    const auto refused = [&](auto&& spoil) {
        SpectralBasis bad = good;
        spoil(bad);
        EXPECT_THROW(check(bad), InputError);
    };
    EXPECT_NO_THROW(check(good));
    refused([](SpectralBasis& b) { b.planes = 0; });
    refused([](SpectralBasis& b) { b.rank = 0; });
    refused([](SpectralBasis& b) { b.rank = 4; });
    refused([](SpectralBasis& b) { b.rank = 2; });
    refused([](SpectralBasis& b) { b.mean.pop_back(); });
    refused([](SpectralBasis& b) { b.mean[1] = std::numeric_limits<double>::infinity(); });
    refused([](SpectralBasis& b) { b.matrix[4] += 1e-6; });
    refused([](SpectralBasis& b) { b.matrix[4] = std::numeric_limits<double>::quiet_NaN(); });
}

}  // namespace
}  // namespace btfield
