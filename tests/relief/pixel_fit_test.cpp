// host/relief/pixel_fit.cpp and kernels/relief/pixel_fit.cl.

#include "host/relief/pixel_fit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <numbers>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "host/relief/relief_names.hpp"
#include "tests/device_cases.hpp"
#include "tests/light_cases.hpp"
#include "tests/reference/pixel_fit.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

/// [light][plane][pixel] of a hilly surface.
std::vector<float> stack_of(Size size, int planes, const std::vector<LightDirection>& lights,
                            test::Light like = {}) {
    const Image normals = test::hilly_normals(size);
    std::vector<float> stack;
    for (size_t k = 0; k < lights.size(); ++k) {
        like.direction = lights[k];
        const Image image = test::lit(normals, planes, like, static_cast<unsigned>(k));
        stack.insert(stack.end(), image.values().begin(), image.values().end());
    }
    return stack;
}

Image normals_of(const PixelFits& fits, Size size) {
    Image normals(size, 3);
    for (size_t i = 0; i < area(size); ++i) {
        const float x = fits.fits[i], y = fits.fits[area(size) + i], z = fits.fits[2 * area(size) + i];
        const float length = std::hypot(x, y, z);
        normals.plane(0)[i] = x / length;
        normals.plane(1)[i] = y / length;
        normals.plane(2)[i] = z / length;
    }
    return normals;
}

/// Grey of one pixel, in float64 of what the kernel reads.
reference::PixelStereo pixel_of(const std::vector<float>& stack, size_t pixels, int planes,
                                const std::vector<LightDirection>& lights, size_t pixel) {
    reference::PixelStereo stereo;
    stereo.lights = lights;
    for (size_t k = 0; k < lights.size(); ++k) {
        double sum = 0.0;
        for (int p = 0; p < planes; ++p)
            sum += static_cast<double>(
                stack[(k * static_cast<size_t>(planes) + static_cast<size_t>(p)) * pixels + pixel]);
        stereo.values.push_back(sum / planes);
    }
    return stereo;
}

reference::Unknowns expected(reference::PixelStereo stereo, const PixelRule& rule) {
    if (rule.rule == LightRule::ls) return stereo.least_squares();
    if (rule.rule == LightRule::ranks) return stereo.ranks(rule.low, rule.high);
    const reference::Unknowns start = stereo.least_squares();
    stereo.set_gate();
    if (rule.rule == LightRule::huber) return stereo.reweighted(start, false, 12, reference::huber_weight);
    return stereo.reweighted(start, true, 12,
                             rule.few_lights ? reference::cauchy_weight : reference::geman_mcclure_weight);
}

double angle(const reference::Unknowns& a, const reference::Unknowns& b) {
    const reference::Vector3 one = reference::unit({a[0], a[1], a[2]}),
                             other = reference::unit({b[0], b[1], b[2]});
    return std::acos(std::clamp(reference::dot(one, other), -1.0, 1.0)) * 180.0 / std::numbers::pi;
}

/// Angles between what the device finds and the reference, sorted.
std::vector<double> angles(Device& device, Size size, int planes, int count, const PixelRule& rule) {
    const std::vector<LightDirection> lights = test::dome(count);
    const std::vector<float> stack = stack_of(size, planes, lights, {.noise = 0.03F, .shadows = 0.1F});
    const PixelFits found = fit_pixels(device.impl(), stack, area(size), planes, lights, rule);
    std::vector<double> result;
    for (size_t i = 0; i < area(size); ++i) {
        reference::Unknowns fit{};
        for (size_t x = 0; x < 5; ++x) fit[x] = static_cast<double>(found.fits[x * area(size) + i]);
        result.push_back(angle(fit, expected(pixel_of(stack, area(size), planes, lights, i), rule)));
    }
    std::ranges::sort(result);
    return result;
}

class PixelFitSmall : public testing::TestWithParam<int> {
  protected:
    Device device_ = test::device_of_width(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Widths, PixelFitSmall, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(PixelFitSmall, LeastSquaresAndRanks) {
    // Sums of some dozens of float32 values and a 3 x 3 system of condition below 100: some 1e-4 radians.
    // Ranks are exact.
    for (const LightRule rule : {LightRule::ls, LightRule::ranks}) {
        const std::vector<double> found = angles(device_, {5, 7}, 3, 16, {.rule = rule});
        EXPECT_LE(found.back(), 0.01) << word_of(rule);
    }
}

class PixelFitWidths : public PixelFitSmall {};
INSTANTIATE_TEST_SUITE_P(Widths, PixelFitWidths, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(PixelFitWidths, RulesFollowTheFormula) {
    for (const LightRule rule : {LightRule::ls, LightRule::ranks, LightRule::huber, LightRule::amb})
        for (const int planes : {1, 3})
            for (const Size size : {Size{1, 1}, Size{13, 11}, Size{16, 16}}) {
                SCOPED_TRACE(std::string(word_of(rule)) + " " + test::text(size));
                const std::vector<double> found = angles(device_, size, planes, 24, {.rule = rule});
                EXPECT_LE(found[found.size() / 2], 0.01);
                // A scale that is rounded the other way moves weights; pixels whose shadows leave two
                // answers may take the other one.
                EXPECT_LE(found[(found.size() - 1) * 97 / 100], 0.2);
            }
}

TEST_P(PixelFitWidths, FewLightsLoseTheirWeightSlowly) {
    const std::vector<double> found =
        angles(device_, {13, 11}, 1, 14, {.rule = LightRule::amb, .few_lights = true});
    EXPECT_LE(found[found.size() / 2], 0.01);
    EXPECT_LE(found[(found.size() - 1) * 97 / 100], 0.2);
}

TEST(PixelFit, ExactLightGivesExactNormals) {
    const Size size{20, 33};
    const std::vector<LightDirection> lights = test::dome(24);
    const std::vector<float> stack = stack_of(size, 3, lights);
    for (const LightRule rule :
         {LightRule::ls, LightRule::ranks, LightRule::huber, LightRule::amb, LightRule::lobe}) {
        SCOPED_TRACE(word_of(rule));
        const PixelFits found =
            fit_pixels(test::default_device().impl(), stack, area(size), 3, lights, {.rule = rule});
        // All hills face all lights. What float32 leaves, and the ridge of the lobe.
        EXPECT_LE(test::mean_angle(normals_of(found, size), test::hilly_normals(size)), 0.05);
        for (int p = 0; p < 3; ++p)
            for (int r = 0; r < size.height; ++r)
                for (int c = 0; c < size.width; ++c)
                    ASSERT_NEAR(found.albedo[static_cast<size_t>(p) * area(size) +
                                             static_cast<size_t>(r * size.width + c)],
                                test::albedo_at(p, r, c), 2e-3F);
        for (const float residual : found.residual) ASSERT_LE(residual, 2e-3F);
    }
}

double error_of(const PixelRule& rule, const test::Light& like) {
    const Size size{24, 24};
    const std::vector<LightDirection> lights = test::dome(36);
    const PixelFits found = fit_pixels(test::default_device().impl(), stack_of(size, 1, lights, like),
                                       area(size), 1, lights, rule);
    return test::mean_angle(normals_of(found, size), test::hilly_normals(size));
}

TEST(PixelFit, RulesAreForWhatTheySay) {
    const test::Light shadows{.noise = 0.01F, .shadows = 0.15F};
    const double plain = error_of({.rule = LightRule::ls}, shadows);
    for (const LightRule rule : {LightRule::huber, LightRule::amb, LightRule::lobe})
        EXPECT_LE(error_of({.rule = rule}, shadows), 0.35 * plain) << word_of(rule);
    EXPECT_LE(error_of({.rule = LightRule::ranks, .low = 0.5, .high = 1.0}, shadows), 0.5 * plain);

    const test::Light ambient{.ambient = 0.3F, .noise = 0.01F};
    EXPECT_LE(error_of({.rule = LightRule::amb}, ambient), 0.75 * error_of({.rule = LightRule::ls}, ambient));

    const test::Light gloss{.noise = 0.01F, .gloss = 0.5F};
    EXPECT_LE(error_of({.rule = LightRule::lobe, .roughness = 0.3}, gloss),
              0.5 * error_of({.rule = LightRule::ls}, gloss));
}

TEST(PixelFit, SaturatedValuesDoNotCount) {
    const Size size{12, 12};
    const std::vector<LightDirection> lights = test::dome(24);
    std::vector<float> stack = stack_of(size, 1, lights);
    for (size_t i = 0; i < area(size); ++i)
        for (const size_t k : {i % 24, (i + 5) % 24}) stack[k * area(size) + i] = -5.0F;  // far too bright
    const PixelFits found =
        fit_pixels(test::default_device().impl(), stack, area(size), 1, lights, {.rule = LightRule::huber});
    EXPECT_LE(test::mean_angle(normals_of(found, size), test::hilly_normals(size)), 0.1);
}

/// The same values, as rows of pixels that lead each other.
PixelStack rows_of(const std::vector<float>& stack, Size size, size_t lights) {
    PixelStack rows;
    rows.pixels = area(size);
    rows.width = static_cast<size_t>(size.width);
    rows.planes = 1;
    rows.gains.assign(lights, 1.0F);
    rows.copy = [&stack, size](int light, std::byte* to, size_t) {
        std::memcpy(to, stack.data() + static_cast<size_t>(light) * area(size), area(size) * sizeof(float));
    };
    return rows;
}

TEST(PixelFit, RowsFollowTheirLeader) {
    const std::vector<LightDirection> lights = test::dome(36);
    const PixelRule rule{.rule = LightRule::lobe, .roughness = 0.3};
    for (const Size size : {Size{1, 40}, Size{2, 5}, Size{4, 17}, Size{24, 24}}) {
        SCOPED_TRACE(test::text(size));
        const std::vector<float> stack = stack_of(size, 1, lights, {.noise = 0.01F, .gloss = 0.5F});
        DeviceImpl& device = test::default_device().impl();
        const PixelFits alone = fit_pixels(device, stack, area(size), 1, lights, rule);
        const PixelFits led = fit_pixels(device, rows_of(stack, size, lights.size()), lights, rule);
        // Every row is fitted, about as well as from two starts.
        const Image truth = test::hilly_normals(size);
        EXPECT_LE(test::mean_angle(normals_of(led, size), truth),
                  1.1 * test::mean_angle(normals_of(alone, size), truth));
        const auto left = [](const PixelFits& fits) {
            return std::accumulate(fits.residual.begin(), fits.residual.end(), 0.0);
        };
        EXPECT_LE(left(led), 1.1 * left(alone));
        EXPECT_EQ(led.counts, alone.counts);
    }
}

TEST(PixelFit, GroupSizesGiveTheSameNumbers) {
    const Size size{17, 31};
    const std::vector<LightDirection> lights = test::dome(20);
    const std::vector<float> stack = stack_of(size, 1, lights, {.noise = 0.05F, .shadows = 0.1F});
    PixelFits before;
    for (const int group : {1, 4, 32}) {
        DeviceOptions options;
        options.work_group_size = group;
        Device device({}, options);
        PixelFits found = fit_pixels(device.impl(), stack, area(size), 1, lights, {.rule = LightRule::lobe});
        if (group > 1) {
            EXPECT_EQ(found.fits, before.fits);
            EXPECT_EQ(found.albedo, before.albedo);
        }
        before = std::move(found);
    }
}

TEST(PixelFit, DarkPixelsAreNoNumbersElse) {
    const std::vector<LightDirection> lights = test::dome(8);
    for (const LightRule rule :
         {LightRule::ls, LightRule::ranks, LightRule::huber, LightRule::amb, LightRule::lobe}) {
        const PixelFits found = fit_pixels(test::default_device().impl(), std::vector<float>(8 * 5, 0.0F), 5,
                                           1, lights, {.rule = rule});
        for (const float value : found.fits) EXPECT_LE(std::abs(value), 1e-6F) << word_of(rule);
        for (const float value : found.albedo) EXPECT_LE(std::abs(value), 1e-6F) << word_of(rule);
    }
}

TEST(PixelFit, PixelsOfOneLightAreFinite) {
    const std::vector<LightDirection> lights = test::dome(12);
    std::vector<float> stack(12, 0.0F);
    stack[5] = 0.3F;
    for (const LightRule rule : {LightRule::huber, LightRule::amb, LightRule::lobe})
        for (const bool few : {false, true}) {
            SCOPED_TRACE(word_of(rule));
            const PixelFits found = fit_pixels(test::default_device().impl(), stack, 1, 1, lights,
                                               {.rule = rule, .few_lights = few});
            for (const float value : found.fits) EXPECT_TRUE(std::isfinite(value));
            for (const float value : found.albedo) EXPECT_TRUE(std::isfinite(value));
        }
}

TEST(PixelFit, ModelledValueIsThatOfTheKernel) {
    // With one light left out of the residual nothing is left: the model explains the others.
    const Size size{6, 6};
    const std::vector<LightDirection> lights = test::dome(30);
    const std::vector<float> stack = stack_of(size, 1, lights, {.noise = 0.02F, .gloss = 0.4F});
    const PixelFits found = fit_pixels(test::default_device().impl(), stack, area(size), 1, lights,
                                       {.rule = LightRule::lobe, .roughness = 0.3});
    for (size_t i = 0; i < area(size); ++i) {
        std::array<double, fit_planes> fit{};
        for (size_t x = 0; x < fit.size(); ++x) fit[x] = static_cast<double>(found.fits[x * area(size) + i]);
        double error = 0.0, all = 0.0;
        for (size_t k = 0; k < lights.size(); ++k) {
            const auto value = static_cast<double>(stack[k * area(size) + i]);
            error += std::abs(value - modelled_value(fit, lights[k], 0.3));
            all += value;
        }
        EXPECT_NEAR(found.residual[i], error / all, 1e-4);
    }
}

}  // namespace
}  // namespace btfield
