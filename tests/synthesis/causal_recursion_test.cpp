// kernels/synthesis/causal_recursion.cl, host/synthesis/causal_recursion.cpp and recursion_stability.cpp.

#include "host/synthesis/causal_recursion.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "btfield/error.hpp"
#include "btfield/lag_covariance.hpp"
#include "host/spectrum/spectral_density.hpp"
#include "host/synthesis/independent_planes.hpp"
#include "host/synthesis/spectral_factors.hpp"
#include "tests/device_cases.hpp"
#include "tests/linear_field_cases.hpp"
#include "tests/reference/causal_recursion.hpp"

namespace btfield {

using namespace detail;

namespace {

using Schedule = CausalRecursion::Schedule;

/// One plane, Σ = 1.
LinearField scalar_field(const std::vector<Offset>& offsets, const std::vector<double>& coefficients) {
    LinearField field;
    field.planes = 1;
    field.offsets = offsets;
    field.coefficients = coefficients;
    field.noise_covariance = {1.0};
    return field;
}

std::vector<float> draw(Device& device, const CausalRecursion& recursion, Size size, int planes,
                        const std::vector<std::uint64_t>& seeds) {
    const std::size_t count = area(size) * static_cast<std::size_t>(planes) * seeds.size();
    std::vector<float> values(count + 64, std::numeric_limits<float>::quiet_NaN());
    const Buffer keys = test::upload_seeds(device, seeds), images = device.impl().upload(values);
    recursion.draw(device.impl(), images, keys, static_cast<int>(seeds.size()), 1);
    values = test::read_all<float>(device, images);
    for (std::size_t i = count; i < values.size(); ++i)
        EXPECT_TRUE(std::isnan(values[i])) << "written beyond the end: " << i - count;
    values.resize(count);
    return values;
}

void expect_reference(Device& device, const LinearField& field, Size size, Schedule schedule) {
    const auto d = static_cast<std::size_t>(field.planes);
    std::vector<double> mean;
    for (std::size_t i = 0; i < d; ++i) mean.push_back(0.5 + static_cast<double>(i));
    const CausalRecursion recursion(device.impl(), field, size, 1.0, mean, schedule);
    const Size domain = recursion.domain();
    const RecursionMargins margins = recursion.margins();
    const Buffer noise_buffer = device.impl().upload(std::vector<float>(2 * d * area(domain)));
    draw_normal_field(device.impl(), noise_buffer, test::upload_seeds(device, {7, 11}), domain, field.planes,
                      2, 1);
    const std::vector<float> noise = test::read_all<float>(device, noise_buffer);
    const std::vector<float> found = draw(device, recursion, size, field.planes, {7, 11});
    // Each value is a sum of (η + 1) d products with rounded coefficients, and the rows of |A| sum to 0.8: an
    // error of that sum is passed on at most 1/(1 − 0.8) times. |y| <= 5 |L n| <= 5 d 6.7 · 2.
    const double bound = 5.0 * test::unit_roundoff *
                         (static_cast<double>((field.offsets.size() + 1) * d) + 3.0) *
                         (5.0 * static_cast<double>(d) * 13.4 + 9.0);
    for (std::size_t b = 0; b < 2; ++b) {
        const std::span<const float> own(noise.data() + b * d * area(domain), d * area(domain));
        const std::vector<double> expected =
            reference::causal_recursion(field, noise_root(field), domain, own);
        std::size_t k = b * d * area(size);
        for (std::size_t i = 0; i < d; ++i) {
            for (int r = 0; r < size.height; ++r) {
                for (int c = 0; c < size.width; ++c, ++k) {
                    const double want = mean[i] + expected[(i * static_cast<std::size_t>(domain.height) +
                                                            static_cast<std::size_t>(r + margins.top)) *
                                                               static_cast<std::size_t>(domain.width) +
                                                           static_cast<std::size_t>(c + margins.left)];
                    ASSERT_TRUE(std::abs(static_cast<double>(found[k]) - want) <= bound)
                        << test::text(size) << ", d = " << d << ", texture " << b << ", plane " << i << ", ("
                        << r << ", " << c << "): " << found[k] << " instead of " << want;
                }
            }
        }
    }
}

class CausalRecursionSmall : public testing::TestWithParam<int> {
  protected:
    Device device_ = test::device_of_width(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Widths, CausalRecursionSmall, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(CausalRecursionSmall, AgreesOnAFewRows) {
    const LinearField field = test::random_field(neighbourhood(2, NeighbourhoodKind::causal), 1, 0.4);
    for (const Schedule schedule : {Schedule::whole, Schedule::waves})
        expect_reference(device_, field, {3, 9}, schedule);
}

class CausalRecursionWidths : public CausalRecursionSmall {};
INSTANTIATE_TEST_SUITE_P(Widths, CausalRecursionWidths, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(CausalRecursionWidths, AgreesWithTheReference) {
    for (const int planes : test::plane_counts) {
        const int order = planes == 1 ? 8 : 3;
        const LinearField field =
            test::random_field(neighbourhood(order, NeighbourhoodKind::causal), planes, 0.8);
        for (const Size size : {Size{1, 1}, Size{17, 31}, Size{2, 150}, Size{67, 3}}) {
            // Every size on one plane and three, a few on more.
            if (planes > 3 && area(size) > 300) continue;
            for (const Schedule schedule : {Schedule::whole, Schedule::waves})
                expect_reference(device_, field, size, schedule);
        }
    }
}

TEST(CausalRecursion, SupportsOfEveryShape) {
    Device device = test::device_of_width(16);
    const std::vector<std::vector<Offset>> supports{
        {{0, -1}},             // rows apart
        {{-1, 0}},             // columns apart
        {{-1, -2}, {-2, -1}},  // never to the right
        {{-1, 7}, {0, -5}},    // far to the right
        neighbourhood(3, NeighbourhoodKind::unilateral),
    };
    for (const std::vector<Offset>& offsets : supports)
        for (const Schedule schedule : {Schedule::whole, Schedule::waves})
            expect_reference(device, test::random_field(offsets, 3, 0.8), {19, 23}, schedule);
    // Planes that nothing couples.
    expect_reference(device, test::random_field(supports.back(), 3, 0.8, false), {19, 23}, Schedule::waves);
}

TEST(CausalRecursion, BatchWidthAndWorkGroupsChangeNothing) {
    const LinearField field = test::random_field(neighbourhood(3, NeighbourhoodKind::causal), 3, 0.8);
    const Size size{20, 70};
    const std::vector<double> mean(3, 0.0);
    Device device = test::device_of_width(16);
    const std::vector<float> both = draw(
        device, CausalRecursion(device.impl(), field, size, 1.0, mean, Schedule::whole), size, 3, {3, 4});
    DeviceOptions options;
    options.vector_width = 4;
    options.work_group_size = 3;
    Device other({}, options);
    const std::vector<float> second =
        draw(other, CausalRecursion(other.impl(), field, size, 1.0, mean, Schedule::waves), size, 3, {4});
    EXPECT_TRUE(
        std::equal(second.begin(), second.end(), both.begin() + static_cast<std::ptrdiff_t>(second.size())));
}

TEST(CausalRecursion, HasTheModelsCovariance) {
    Device device;
    const LinearField field = test::random_field(neighbourhood(2, NeighbourhoodKind::causal), 2, 0.85);
    const Size size{96, 96};
    const int batch = 48;
    std::vector<std::uint64_t> seeds;
    for (std::uint64_t seed = 1; seed <= batch; ++seed) seeds.push_back(seed);
    const CausalRecursion recursion(device.impl(), field, size, 1.0, {0.0, 0.0});
    const std::vector<float> textures = draw(device, recursion, size, 2, seeds);
    const Offset box{3, 3};
    const LagCovariance model = model_covariance(field, {128, 128}, box);
    for (const Offset s : {Offset{0, 0}, Offset{0, 1}, Offset{1, 0}, Offset{1, -1}, Offset{2, 3}}) {
        for (int i = 0; i < 2; ++i) {
            for (int j = 0; j < 2; ++j) {
                double sum = 0.0, squares = 0.0;
                for (int b = 0; b < batch; ++b) {
                    const auto value = [&](int plane, int r, int c) {
                        return static_cast<double>(textures[(static_cast<std::size_t>(b * 2 + plane) * 96 +
                                                             static_cast<std::size_t>(r)) *
                                                                96 +
                                                            static_cast<std::size_t>(c)]);
                    };
                    double product = 0.0;
                    for (int r = 3; r < 93; ++r)
                        for (int c = 3; c < 93; ++c)
                            product += value(i, r, c) * value(j, r + s.row, c + s.column);
                    product /= 90.0 * 90.0;
                    sum += product;
                    squares += product * product;
                }
                const double mean = sum / batch;
                const double error = std::sqrt((squares / batch - mean * mean) / (batch - 1));
                // 20 comparisons within 5 standard errors of the mean of independent textures, and what the
                // margins leave out at the outermost pixels.
                const double missing =
                    3.0 * recursion.margins().missing * std::sqrt(model(i, i, {}) * model(j, j, {}));
                EXPECT_LE(std::abs(mean - model(i, j, s)), 5.0 * error + missing)
                    << i << j << " (" << s.row << ", " << s.column << ")";
            }
        }
    }
}

TEST(CausalRecursion, StabilityIsThatOfClosedForms) {
    struct Case {
        std::vector<Offset> offsets;
        std::vector<double> coefficients;
        double along, down, frequency;
    };
    const double pi = std::numbers::pi;
    const Case cases[] = {
        {{{0, -1}}, {0.9}, 0.9, 0.0, 0.0},
        {{{-1, 0}}, {-0.97}, 0.0, 0.97, 0.0},
        // a z1 + b z1 e^{iω}: |a + b e^{iω}| is largest at 0 or π.
        {{{-1, 0}, {-1, 1}}, {0.7, 0.4}, 0.0, 1.1, 0.0},
        {{{-1, 0}, {-1, 1}}, {0.7, -0.4}, 0.0, 1.1, pi},
        // (1 − 0.8 z1)(1 − 0.9 z2): separable, 0.8 at every frequency.
        {{{-1, 0}, {0, -1}, {-1, -1}}, {0.8, 0.9, -0.72}, 0.9, 0.8, 0.0},
        // 0.5 / |1 − 0.5 e^{−iω}|: 1 at ω = 0, no longer stable.
        {{{-1, 0}, {0, -1}}, {0.5, 0.5}, 0.5, 1.0, 0.0},
        {{{-1, 0}, {0, -1}}, {0.5, -0.45}, 0.45, 0.5 / 0.55, pi},
        // λ² = 0.81 at all frequencies.
        {{{-2, 3}}, {0.81}, 0.0, 0.9, 0.0},
    };
    for (const Case& c : cases) {
        const LinearField field = scalar_field(c.offsets, c.coefficients);
        const RecursionStability found = recursion_stability(field);
        // A handful of roundings in eigenvalues that are well apart.
        EXPECT_NEAR(found.along_rows, c.along, 1e-12);
        EXPECT_NEAR(found.down_rows, c.down, 1e-12);
        EXPECT_EQ(found.stable, c.along < 1.0 && c.down < 1.0) << found.explanation;
        EXPECT_EQ(found.stable, found.explanation.empty());
        // A maximum is flat: its place is known to the root of the rounding.
        if (c.offsets.size() == 2) {
            EXPECT_NEAR(found.column_frequency, c.frequency, 1e-6);
        }
    }
    EXPECT_FALSE(recursion_stability(scalar_field({{0, -1}}, {1.01})).stable);
    EXPECT_FALSE(recursion_stability(scalar_field({{0, -1}, {0, -2}}, {1.0, 0.01})).stable);
    EXPECT_THROW(static_cast<void>(recursion_stability(scalar_field({{0, 1}}, {0.1}))), InputError);
    EXPECT_THROW(static_cast<void>(recursion_stability(scalar_field({{1, -1}}, {0.1}))), InputError);
}

TEST(CausalRecursion, AZeroBetweenGridFrequenciesIsFound) {
    // 1/(1 − 2ρ cos φ z + ρ² z²) along a row peaks sharply near φ; times 0.0…, the growth down the rows peaks
    // there too. φ lies between two points of any grid by powers of two.
    const double rho = 0.995, phi = 1.2345;
    const double peak = 1.0 / std::abs((1.0 - rho) * (1.0 - rho * std::polar(1.0, -2.0 * phi)));
    const auto with = [&](double growth) {
        return recursion_stability(scalar_field({{-1, 0}, {0, -1}, {0, -2}},
                                                {growth / peak, 2.0 * rho * std::cos(phi), -rho * rho}));
    };
    EXPECT_FALSE(with(1.02).stable);
    EXPECT_NEAR(with(1.02).column_frequency, phi, 2.0 * (1.0 - rho));
    EXPECT_TRUE(with(0.98).stable) << with(0.98).explanation;
}

TEST(CausalRecursion, UnstableModelsAreRefusedBeforeTheyRun) {
    Device device;
    const LinearField field = scalar_field({{-1, 0}, {-1, 1}}, {0.7, -0.4});
    const std::uint64_t before = device.launch_count();
    try {
        const CausalRecursion recursion(device.impl(), field, {8, 8}, 1.0, {0.0});
        ADD_FAILURE() << "grows by 1.1 a row";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("1.1 a row"), std::string::npos) << error.what();
    }
    EXPECT_EQ(device.launch_count(), before);
}

TEST(CausalRecursion, MarginsFollowTheDecay) {
    // Energy beyond m pixels is ρ^{2m}: 1e-3 at m = ln 1e-3 / (2 ln ρ).
    const auto expected = [](double rho) {
        return static_cast<int>(std::ceil(std::log(1e-3) / (2.0 * std::log(rho))));
    };
    const RecursionMargins down = recursion_margins(scalar_field({{-1, 0}}, {0.9}));
    EXPECT_EQ(down.top, expected(0.9));
    EXPECT_EQ(down.left, 0);
    const RecursionMargins along = recursion_margins(scalar_field({{0, -1}}, {0.9}));
    EXPECT_NEAR(along.left, expected(0.9), 1);
    EXPECT_EQ(along.right, 0);
    const RecursionMargins slanted = recursion_margins(scalar_field({{-1, 1}}, {0.9}));
    EXPECT_EQ(slanted.left, 0);
    EXPECT_NEAR(slanted.right, expected(0.9), 1);
    EXPECT_LE(recursion_margins(scalar_field({{-1, 0}}, {0.9999})).top, 256);
    EXPECT_GT(recursion_margins(scalar_field({{-1, 0}}, {0.9999})).missing, 0.1);
}

}  // namespace
}  // namespace btfield
