// host/compound/conditional_mean.cpp and kernels/compound/conditional_mean.cl.

#include "host/compound/conditional_mean.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "tests/device_cases.hpp"
#include "tests/label_cases.hpp"
#include "tests/reference/conditional_mean.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

MeanWeights random_weights(int planes, int regions, int filters) {
    std::mt19937 generator(static_cast<unsigned>(100 * planes + regions));
    std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
    MeanWeights weights;
    for (int p = 0; p < planes; ++p) weights.mean.push_back(static_cast<double>(uniform(generator)));
    weights.regions.resize(static_cast<size_t>(regions));
    for (std::vector<double>& region : weights.regions)
        for (int n = 0; n < filters * planes; ++n) region.push_back(static_cast<double>(uniform(generator)));
    return weights;
}

/// What no value of plane p exceeds, nor any of its sums' parts: smoothing averages, derivatives are halved.
double magnitude(const MeanWeights& weights, size_t p) {
    const size_t d = weights.mean.size();
    double sum = std::abs(weights.mean[p]);
    for (size_t n = p; n < weights.regions.front().size(); n += d) {
        double most = 0.0;
        for (const std::vector<double>& region : weights.regions) most = std::max(most, std::abs(region[n]));
        sum += most;
    }
    return sum;
}

Image mean_of(Device& device, const MeanWeights& weights, const ControlField& field) {
    const DevicePlanes planes =
        ConditionalMean(device.impl(), weights).of(device.impl().upload(field.labels), field.size);
    EXPECT_EQ(planes.size, field.size);
    EXPECT_EQ(planes.lattice, field.size);
    Image image(field.size, planes.planes);
    device.impl().read(planes.values, image.values().data(), image.values().size_bytes());
    return image;
}

/// Rounding at a scale: two differences and four sums with what was there, 6; along each of two axes the
/// rounded taps, a sum of two, a product and two fused ones, 10. Then weights and mean, rounded to float32 if
/// they were not, and two sums.
void expect_reference(Device& device, Size size, int planes, int regions, int filters = context_filters) {
    SCOPED_TRACE(test::text(size) + ", d = " + std::to_string(planes) + ", K = " + std::to_string(regions) +
                 ", filters " + std::to_string(filters));
    const MeanWeights weights = random_weights(planes, regions, filters);
    const ControlField field = test::patchy_labels(size, regions);
    const Image found = mean_of(device, weights, field);
    ASSERT_EQ(found.planes(), planes);
    const std::vector<reference::Plane> expected =
        reference::conditional_mean(weights.mean, weights.regions, field);
    for (int p = 0; p < planes; ++p) {
        const auto plane = static_cast<size_t>(p);
        const double bound =
            (context_scales * (6 + 10) + 4) * test::unit_roundoff * magnitude(weights, plane);
        for (size_t i = 0; i < area(size); ++i)
            ASSERT_LE(std::abs(static_cast<double>(found.plane(p)[i]) - expected[plane].values[i]), bound)
                << "plane " << p << ", pixel " << i;
    }
}

class ConditionalMeanSmall : public testing::TestWithParam<int> {
  protected:
    Device device_ = test::device_of_width(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Widths, ConditionalMeanSmall, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(ConditionalMeanSmall, FollowsTheFormula) {
    // 16 lanes, too, find a vector that smoothing reads without going round.
    expect_reference(device_, {9, 37}, 3, 2);
    expect_reference(device_, {3, 21}, 3, 2, 1);
}

class ConditionalMeanWidths : public ConditionalMeanSmall {};
INSTANTIATE_TEST_SUITE_P(Widths, ConditionalMeanWidths, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(ConditionalMeanWidths, EverySizeAndNumberOfRegions) {
    // Smoothing reaches 16 pixels at the coarsest scale alone: it goes round the smaller ones more than once.
    for (const Size size : {Size{1, 1}, Size{2, 3}, Size{1, 67}, Size{67, 1}, Size{5, 11}, Size{16, 16},
                            Size{17, 23}, Size{40, 64}, Size{33, 100}})
        for (const int regions : {1, 2, 7}) expect_reference(device_, size, 3, regions);
}

TEST_P(ConditionalMeanWidths, BordersWithoutContextHaveOneFilter) {
    for (const Size size : {Size{1, 1}, Size{17, 23}, Size{40, 64}}) expect_reference(device_, size, 3, 7, 1);
}

TEST(ConditionalMean, EveryNumberOfPlanes) {
    for (const int planes : {1, 4})
        for (const Size size : {Size{5, 11}, Size{17, 37}}) {
            expect_reference(test::default_device(), size, planes, 7);
            expect_reference(test::default_device(), size, planes, 2, 1);
        }
    expect_reference(test::default_device(), {17, 37}, 1, most_regions);
}

TEST(ConditionalMean, TapsAreThoseOfGaussians) {
    double variance = 0.0;
    for (int scale = 0; scale < context_scales; ++scale) {
        const std::array<double, 3> taps = smoothing_taps(scale);
        const double step = 1 << scale;
        // Exact but for the rounding of a few sums.
        EXPECT_NEAR(taps[0] + 2 * taps[1] + 2 * taps[2], 1.0, 1e-15);
        for (const double tap : taps) EXPECT_GT(tap, 0.0);
        variance += 2 * taps[1] * step * step + 2 * taps[2] * 4 * step * step;
        EXPECT_NEAR(variance, step * step, 1e-13 * step * step) << "scale " << scale;
    }
}

// Regression
// ----------------------------------------------------------------------------------------------------

Image picture_of(const MeanWeights& weights, const ControlField& field) {
    Image image(field.size, static_cast<int>(weights.mean.size()));
    const std::vector<reference::Plane> planes =
        reference::conditional_mean(weights.mean, weights.regions, field);
    for (int p = 0; p < image.planes(); ++p)
        std::ranges::transform(planes[static_cast<size_t>(p)].values, image.plane(p).begin(),
                               [](double value) { return static_cast<float>(value); });
    return image;
}

double variance_of(const std::vector<double>& values) {
    double sum = 0.0, squares = 0.0;
    for (const double value : values) sum += value;
    const double mean = sum / static_cast<double>(values.size());
    for (const double value : values) squares += (value - mean) * (value - mean);
    return squares / static_cast<double>(values.size());
}

/// Share of a plane's variance that the weights leave, over the pixels `margin` from every edge.
double left_over(const Image& image, int p, const MeanWeights& weights, const ControlField& field,
                 int margin = 0) {
    const reference::Plane mean =
        reference::conditional_mean(weights.mean, weights.regions, field)[static_cast<size_t>(p)];
    std::vector<double> values, residuals;
    for (int r = margin; r < image.height() - margin; ++r)
        for (int c = margin; c < image.width() - margin; ++c) {
            values.push_back(static_cast<double>(image.at(p, r, c)));
            residuals.push_back(values.back() - mean.at(r, c));
        }
    return variance_of(residuals) / variance_of(values);
}

void expect_shape(const MeanWeights& weights, int planes, int regions, int filters) {
    EXPECT_EQ(weights.mean.size(), static_cast<size_t>(planes));
    ASSERT_EQ(weights.regions.size(), static_cast<size_t>(regions));
    const auto kept = [](double value) {  // NaN is not
        return value == static_cast<double>(static_cast<float>(value)) && std::isfinite(value);
    };
    EXPECT_TRUE(std::ranges::all_of(weights.mean, kept));
    for (const std::vector<double>& region : weights.regions) {
        EXPECT_EQ(region.size(), static_cast<size_t>(planes * filters));
        EXPECT_TRUE(std::ranges::all_of(region, kept));
    }
}

TEST(ConditionalMeanFit, PicturesThatLabelsTellAreRecovered) {
    // The last has more pixels than are observed.
    for (const auto& [size, planes, regions] :
         {std::tuple{Size{96, 80}, 3, 3}, std::tuple{Size{64, 64}, 1, 1}, std::tuple{Size{330, 340}, 1, 2}}) {
        SCOPED_TRACE(test::text(size));
        const ControlField field = test::patchy_labels(size, regions);
        const Image image = picture_of(random_weights(planes, regions, context_filters), field);
        const MeanWeights found = fit_conditional_mean(image, field);
        expect_shape(found, planes, regions, context_filters);
        for (int p = 0; p < planes; ++p) {
            if (regions > 1) {
                EXPECT_LE(left_over(image, p, found, field), 1e-4) << "plane " << p;
                continue;
            }
            // One region is everywhere: the picture is one value, which the ridge shifts by 1e-6 of it.
            const reference::Plane mean =
                reference::conditional_mean(found.mean, found.regions, field)[static_cast<size_t>(p)];
            for (const double value : mean.values)
                EXPECT_NEAR(value, static_cast<double>(image.at(p, 0, 0)), 1e-5);
        }
    }
}

TEST(ConditionalMeanFit, EdgesAreNotLookedAt) {
    const Size size{96, 96};
    const int margin = 12;  // an eighth of the side
    const ControlField field = test::patchy_labels(size, 3);
    Image image = picture_of(random_weights(1, 3, context_filters), field);
    for (int r = 0; r < size.height; ++r)
        for (int c = 0; c < size.width; ++c)
            if (std::min({r, c, size.height - 1 - r, size.width - 1 - c}) < margin)
                image.at(0, r, c) = 1000.0F;
    EXPECT_LE(left_over(image, 0, fit_conditional_mean(image, field), field, margin), 1e-4);
}

TEST(ConditionalMeanFit, PicturesThatLabelsDoNotTellAreLeftAlone) {
    // 26 unknowns take about 26 of 96² degrees of freedom of white noise, 0.3 % of the variance.
    const ControlField field = test::patchy_labels({128, 128}, 2);
    const Image image = test::random_image(field.size, 2, 5.0F);
    const MeanWeights found = fit_conditional_mean(image, field);
    for (int p = 0; p < 2; ++p) {
        const double left = left_over(image, p, found, field);
        EXPECT_GE(left, 0.99);
        EXPECT_LE(left, 1.01);
    }
}

TEST(ConditionalMeanFit, WeightsOfFewPixelsFitOtherLabelsToo) {
    // 409 unknowns of 40² pixels, two thirds of what varies noise: labels of the same kind elsewhere must not
    // get more variance than the picture's.
    const ControlField field = test::patchy_labels({40, 40}, 24),
                       other = test::patchy_labels({64, 64}, 24, 8);
    Image image = test::random_image(field.size, 1, 0.0F);
    for (size_t n = 0; n < field.labels.size(); ++n)
        image.plane(0)[n] += 0.1F * static_cast<float>(field.labels[n] % 7);
    const double all = variance_of({image.values().begin(), image.values().end()});
    const MeanWeights found = fit_conditional_mean(image, field);
    const auto share = [&](const ControlField& labels) {
        return variance_of(reference::conditional_mean(found.mean, found.regions, labels)[0].values) / all;
    };
    EXPECT_LT(share(other), 1.0);
    EXPECT_NEAR(share(other), share(field), 0.3);
}

TEST(ConditionalMeanFit, SmallPicturesHaveWeightsToo) {
    for (const Size size : {Size{1, 1}, Size{1, 7}, Size{9, 2}, Size{12, 13}}) {
        SCOPED_TRACE(test::text(size));
        const ControlField field = test::patchy_labels(size, 2);
        expect_shape(fit_conditional_mean(test::random_image(size, 2), field), 2, 2, context_filters);
    }
}

TEST(ConditionalMeanFit, MeansOfRegions) {
    ControlField field = test::patchy_labels({17, 23}, 3);
    field.regions = 4;  // the last one nowhere
    const Image image = test::random_image(field.size, 2, 3.0F);
    const MeanWeights found = regional_means(image, field);
    expect_shape(found, 2, 4, 1);
    EXPECT_EQ(found.mean, (std::vector<double>{0.0, 0.0}));
    for (int k = 0; k < 4; ++k)
        for (int p = 0; p < 2; ++p) {
            double sum = 0.0, count = 0.0;
            for (size_t i = 0; i < field.labels.size(); ++i)
                if (field.labels[i] == k) {
                    sum += static_cast<double>(image.plane(p)[i]);
                    count += 1.0;
                }
            const double mean = count > 0.0 ? sum / count : 0.0;
            // One rounding to float32.
            EXPECT_NEAR(found.regions[static_cast<size_t>(k)][static_cast<size_t>(p)], mean,
                        test::unit_roundoff * std::abs(mean) + 1e-300);
        }
}

}  // namespace
}  // namespace btfield
