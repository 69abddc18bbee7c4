#include "btfield/marginals.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "btfield/spectral_basis.hpp"
#include "host/base/normal_distribution.hpp"
#include "tests/device_cases.hpp"
#include "tests/places.hpp"
#include "tests/reference/lag_covariance.hpp"
#include "tests/reference/plane_restorer.hpp"

namespace btfield {

using namespace detail;

namespace {

double variance(const Image& image, int plane) {
    return reference::lag_covariance(image, plane, plane, {0, 0});
}

std::vector<float> sorted(std::span<const float> values) {
    std::vector<float> result(values.begin(), values.end());
    std::ranges::sort(result);
    return result;
}

/// Root mean square of the difference of two planes' quantiles.
double quantile_error(std::span<const float> a, std::span<const float> b) {
    const std::vector<float> x = sorted(a), y = sorted(b);
    double sum = 0.0;
    for (std::size_t k = 0; k < x.size(); ++k)
        sum += (static_cast<double>(x[k]) - static_cast<double>(y[k])) *
               (static_cast<double>(x[k]) - static_cast<double>(y[k]));
    return std::sqrt(sum / static_cast<double>(x.size()));
}

/// Values f(x) of normals x.
template <class F>
Image mapped_normals(Size size, const F& f) {
    Image image = test::random_image(size, 1);
    for (float& value : image.values()) value = static_cast<float>(f(static_cast<double>(value)));
    return image;
}

// E q(x) and Var q(x) by the trapezoidal rule; kinks leave h²/12 of their jumps, 1e-6 of the variance at h =
// 0.002.
std::pair<double, double> moments_of_mapped_normal(const Marginal& marginal) {
    constexpr double h = 0.002;
    double mean = 0.0, square = 0.0;
    for (int k = -4000; k <= 4000; ++k)
        mean += h * normal_density(k * h) * reference::mapped(marginal.values, k * h);
    for (int k = -4000; k <= 4000; ++k) {
        const double c = reference::mapped(marginal.values, k * h) - mean;
        square += h * normal_density(k * h) * c * c;
    }
    return {mean, square};
}

TEST(NormalDistribution, QuantileInvertsTheCumulative) {
    for (double x = -8.0; x < 8.0; x += 0.0625) {
        const double u = normal_cumulative(x);
        // Above 1/2, u is rounded by 2⁻⁵³, which moves x by 2⁻⁵³/φ(x); the approximation is good to 1e-15
        // relative.
        const double bound = 4e-15 * std::abs(x) + (x > 0.0 ? 2.3e-16 / normal_density(x) : 1e-16);
        if (u < 1.0) {
            EXPECT_LE(std::abs(normal_quantile(u) - x), bound) << x;
        }
    }
    EXPECT_EQ(normal_quantile(0.5), 0.0);
    EXPECT_LE(std::abs(normal_quantile(0.975) - 1.959963984540054), 1e-14);
    EXPECT_LE(std::abs(normal_quantile(1e-20) + 9.262340089798408), 1e-13);
    EXPECT_LE(
        std::abs(normal_probability(6.0, 7.0) / (9.8658764503769814e-10 - 1.2798125438858350e-12) - 1.0),
        1e-12);
    EXPECT_LE(std::abs(normal_probability(-1.0, 1.0) - 0.682689492137086), 1e-14);
}

TEST(Marginals, GaussianPlanesAreStandardNormals) {
    for (const Size size : {Size{1, 2}, Size{2, 3}, Size{13, 11}, Size{64, 64}, Size{101, 97}}) {
        SCOPED_TRACE(test::text(size));
        const GaussianPlanes found = gaussianise(test::random_image(size, 3, 5.0F));
        ASSERT_EQ(found.marginals.size(), 3U);
        for (int p = 0; p < 3; ++p) {
            // Scores mirror each other exactly; their squares are rounded to float32.
            EXPECT_LE(std::abs(reference::mean(found.planes, p)), 1e-12);
            EXPECT_LE(std::abs(variance(found.planes, p) - 1.0), 4.0 * test::unit_roundoff);
        }
    }
    // Known scores: Φ⁻¹ of 1/8, 3/8, 5/8, 7/8 over their deviation.
    Image four({1, 4}, 1);
    const float values[] = {3.0F, -1.0F, 7.0F, 2.0F};
    std::ranges::copy(values, four.values().begin());
    const double a = 1.1503493803760079, b = 0.3186393639643752, scale = std::sqrt((a * a + b * b) / 2.0);
    const Image scores = gaussianise(four).planes;
    const double expected[] = {b / scale, -a / scale, a / scale, -b / scale};
    for (std::size_t k = 0; k < 4; ++k)
        EXPECT_LE(std::abs(static_cast<double>(scores.values()[k]) - expected[k]), 2.0 * test::unit_roundoff);
}

TEST(Marginals, OrderIsKept) {
    const Image image = mapped_normals({40, 50}, [](double x) { return std::round(3.0 * x); });
    const Image found = gaussianise(image).planes;
    for (std::size_t a = 0; a < 2000; ++a)
        for (std::size_t b = 0; b < 2000; b += 37)
            if (image.values()[a] < image.values()[b]) {
                ASSERT_LT(found.values()[a], found.values()[b]);
            }
}

TEST(Marginals, TiesAreSpreadTheSameWayEachTime) {
    // Two planes with the same two values: ranks within a value differ between the planes, and look like
    // white noise.
    const Size size{96, 96};
    Image image(size, 2);
    for (int p = 0; p < 2; ++p)
        for (int row = 0; row < size.height; ++row)
            for (int column = 0; column < size.width; ++column)
                image.at(p, row, column) = row < 48 ? 0.0F : 1.0F;
    const GaussianPlanes first = gaussianise(image), second = gaussianise(image);
    EXPECT_TRUE(
        std::ranges::equal(std::as_const(first.planes).values(), std::as_const(second.planes).values()));
    Image upper(Size{48, 96}, 2);
    for (int p = 0; p < 2; ++p)
        std::copy_n(first.planes.plane(p).begin(), area(upper.size()), upper.plane(p).begin());
    // Half a normal has variance 1 − 2/π. N values: six deviations of 1/√N.
    const double half = 1.0 - 2.0 / 3.14159265358979, bound = 6.0 * half / std::sqrt(48.0 * 96.0);
    EXPECT_LE(std::abs(variance(upper, 0) - half), 0.01);
    EXPECT_LE(std::abs(reference::lag_covariance(upper, 0, 1, {0, 0})), bound);
    for (const Offset s : {Offset{0, 1}, Offset{1, 0}, Offset{1, 1}, Offset{0, 2}, Offset{5, -3}})
        EXPECT_LE(std::abs(reference::lag_covariance(upper, 0, 0, s)), bound);
}

TEST(Marginals, KnownQuantileFunctionsAreFound) {
    const Size size{400, 400};
    const auto error = [&](const auto& f) {
        const Marginal marginal = gaussianise(mapped_normals(size, f)).marginals[0];
        double most = 0.0;
        for (double x = -2.5; x <= 2.5; x += 0.01)
            most = std::max(most, std::abs(quantile(marginal, x) - f(x)));
        return most;
    };
    // Interpolation in steps h = 7/(n − 1) is off by up to h²/8 max|f''|, on ±(2.5 + h) here; the picture's
    // own quantiles by 5 √(u(1 − u)/N) f'/φ, at x = 2.5: 5 · 4.5/400 f'.
    const double h = 7.0 / (default_knots - 1), sampling = 5.0 * 4.5 / 400.0;
    EXPECT_LE(error([](double x) { return x; }), sampling);
    EXPECT_LE(error([](double x) { return std::exp(0.5 * x); }),
              h * h / 8.0 * 0.25 * std::exp(0.5 * (2.5 + h)) + 0.5 * std::exp(1.25) * sampling);
    EXPECT_LE(error([](double x) { return normal_cumulative(x); }), h * h / 8.0 * 0.25 + 0.4 * sampling);
}

TEST(Marginals, MappedNormalsHaveThePlanesMeanAndVariance) {
    for (const Size size : {Size{2, 2}, Size{7, 9}, Size{120, 100}}) {
        SCOPED_TRACE(test::text(size));
        Image image(size, 5);
        const Image normals = test::random_image(size, 1);
        for (std::size_t k = 0; k < area(size); ++k) {
            const float x = normals.values()[k];
            const float values[] = {x, std::exp(x), std::round(2.0F * x), k % 2 == 0 ? 1.0F : 0.0F,
                                    k == 1 ? 1000.0F : 0.0F};
            for (int p = 0; p < 5; ++p) image.plane(p)[k] = values[p];
        }
        // Such a small picture may have rounded to one value.
        image.plane(2)[0] += 1.0F;
        image.plane(2)[1] -= 1.0F;
        const GaussianPlanes found = gaussianise(image);
        for (int p = 0; p < 5; ++p) {
            const Marginal& marginal = found.marginals[static_cast<std::size_t>(p)];
            EXPECT_NO_THROW(check(marginal)) << p;
            const auto [mean, second] = moments_of_mapped_normal(marginal);
            const double expected = variance(image, p);
            EXPECT_LE(std::abs(mean - reference::mean(image, p)), 1e-5 * std::sqrt(expected)) << p;
            EXPECT_LE(std::abs(second - expected), 1e-5 * expected) << p;
        }
    }
}

TEST(Marginals, QuantileIsConstantBeyondTheEnds) {
    const Marginal marginal{{-2.0, -1.0, 0.5, 4.0, 5.0}};
    EXPECT_EQ(quantile(marginal, -3.5), -2.0);
    EXPECT_EQ(quantile(marginal, -100.0), -2.0);
    EXPECT_EQ(quantile(marginal, 3.5), 5.0);
    EXPECT_EQ(quantile(marginal, std::numeric_limits<double>::infinity()), 5.0);
    EXPECT_EQ(quantile(marginal, 0.0), 0.5);
    EXPECT_LE(std::abs(quantile(marginal, 0.875) - 2.25), 1e-15);
    EXPECT_TRUE(std::isnan(quantile(marginal, std::numeric_limits<double>::quiet_NaN())));
    for (double x = -4.0; x <= 4.0; x += 0.03)
        EXPECT_LE(std::abs(quantile(marginal, x) - reference::mapped(marginal.values, x)), 1e-14);
}

/// Through the eigenplanes, the normals and back.
void check_round_trip(const Image& image, int knots) {
    SCOPED_TRACE(std::to_string(knots) + " knots");
    const SpectralBasis basis = spectral_basis(image);
    const Image planes = to_eigenplanes(basis, image);
    const GaussianPlanes gaussian = gaussianise(planes, knots);
    const Image mapped = map_back(gaussian.planes, gaussian.marginals);
    const Image back = from_eigenplanes(basis, mapped, image.space());
    // 1 % is promised with the default. Fewer knots smooth the steps of a palette, in all eigenplanes at the
    // same pixels.
    const double deviation = knots < default_knots ? 0.02 : 0.01;
    for (int p = 0; p < basis.rank; ++p) {
        // Exact for a normal; ranks are one but for what a pixel weighs.
        EXPECT_LE(std::abs(std::sqrt(variance(mapped, p) / variance(planes, p)) - 1.0), 1e-3)
            << "eigenplane " << p;
        // Measured: at most 0.16 of a deviation, on pictures of few colours; 0.03 on photographs. An
        // eigenplane with next to no variance is constant but for strays, which no knots follow and no
        // picture shows.
        const double error = quantile_error(planes.plane(p), mapped.plane(p));
        const double weight = variance(planes, p) / variance(planes, 0);
        EXPECT_LE(error, (weight > 1e-4 ? 0.17 : 2.0) * std::sqrt(variance(planes, p))) << "eigenplane " << p;
    }
    for (int p = 0; p < image.planes(); ++p) {
        EXPECT_LE(std::abs(std::sqrt(variance(back, p) / variance(image, p)) - 1.0), deviation)
            << "plane " << p;
        EXPECT_LE(std::abs(reference::mean(back, p) - reference::mean(image, p)),
                  1e-3 * std::sqrt(variance(image, p)));
    }
    // Less than half a level of 8 bits beyond [0, 1] is nothing that a file shows.
    const auto outside = [](float v) { return !(v >= -0.5F / 255.0F && v <= 1.0F + 0.5F / 255.0F); };
    if (std::ranges::none_of(image.values(), outside)) {
        EXPECT_LE(static_cast<double>(std::ranges::count_if(back.values(), outside)),
                  1e-4 * static_cast<double>(back.values().size()));
    }
}

TEST(Marginals, RealPicturesComeBack) {
    for (const char* name :
         {"cork.png", "bark.png", "rock.png", "sand.png", "grass.png", "landsat.tif", "cork-xyz.exr"}) {
        SCOPED_TRACE(name);
        const Image image = read_picture(test::data_folder() + "/" + name).image;
        for (const int knots : {16, default_knots}) check_round_trip(image, knots);
    }
}

TEST(MarginalsLong, SharedPicturesComeBack) {
    // Beside a checkout, where they exist; those of tests/data have gone the same way above.
    const std::filesystem::path folder = std::filesystem::path(test::data_folder()) / "../../../shared/data";
    std::vector<std::filesystem::path> pictures{test::data_folder() + "/cork.png"};
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator(folder, none)) {
        const std::string kind = entry.path().extension().string();
        if (kind == ".png" || kind == ".jpg" || kind == ".tif" || kind == ".exr")
            pictures.push_back(entry.path());
    }
    for (const auto& path : pictures) {
        SCOPED_TRACE(path.filename().string());
        for (const int knots : {16, 24, 32}) check_round_trip(read_picture(path.string()).image, knots);
    }
}

TEST(Marginals, RefusesWhatHasNoMarginal) {
    const Image good = test::random_image({8, 8}, 2);
    EXPECT_THROW((void)gaussianise(Image()), InputError);
    for (const int knots : {-1, 0, fewest_knots - 1, most_knots + 1})
        EXPECT_THROW((void)gaussianise(good, knots), InputError);
    Image constant = good;
    std::ranges::fill(constant.plane(1), 0.25F);
    EXPECT_THROW((void)gaussianise(constant), InputError);
    EXPECT_THROW((void)gaussianise(Image({1, 1}, 1)), InputError);
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        Image image = good;
        image.at(1, 3, 4) = bad;
        EXPECT_THROW((void)gaussianise(image), InputError);
    }
    const GaussianPlanes found = gaussianise(good);
    EXPECT_THROW((void)map_back(Image({8, 8}, 3), found.marginals), InputError);
}

TEST(Marginals, CheckNamesDefects) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_NO_THROW(check(Marginal{{0.0, 0.0, 1.0, 1.0}}));
    EXPECT_THROW(check(Marginal{}), InputError);
    EXPECT_THROW(check(Marginal{{0.0, 1.0, 2.0}}), InputError);
    EXPECT_THROW(check(Marginal{std::vector<double>(65, 1.0)}), InputError);
    EXPECT_THROW(check(Marginal{{0.0, 1.0, 0.5, 2.0}}), InputError);
    EXPECT_THROW(check(Marginal{{1.0, 1.0, 1.0, 1.0}}), InputError);
    EXPECT_THROW(check(Marginal{{0.0, 1.0, nan, 2.0}}), InputError);
}

}  // namespace
}  // namespace btfield
