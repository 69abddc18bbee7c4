// host/compound/regional_gains.cpp, by way of fit_regions().

#include "host/compound/regional_gains.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "btfield/image_io.hpp"
#include "btfield/pyramid.hpp"
#include "host/compound/conditional_mean.hpp"
#include "host/compound/regional_fields.hpp"
#include "host/compound/regional_fit.hpp"
#include "tests/device_cases.hpp"
#include "tests/label_cases.hpp"
#include "tests/places.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

TEST(RegionalGains, VariancesAreThoseOfTheRegions) {
    Image image({2, 3}, 2);
    std::ranges::copy(std::array{1.0F, 3.0F, 5.0F, 7.0F, 7.0F, 7.0F, 0.0F, 4.0F, 0.0F, 0.0F, 0.0F, 6.0F},
                      image.values().begin());
    const std::vector<std::uint8_t> labels{0, 0, 1, 1, 1, 1};
    // 1, 3 and 0, 4; 5, 7, 7, 7 and 0, 0, 0, 6; none.
    EXPECT_EQ(regional_variances(image, labels, 3), (std::vector<double>{1.0, 4.0, 0.75, 6.75, 0.0, 0.0}));
}

TEST(RegionalGains, CoarseLabelsAreThoseOfEveryStep) {
    const ControlField field{{3, 4}, 9, {0, 1, 2, 3, 4, 5, 6, 7, 8, 0, 1, 2}};
    EXPECT_EQ(coarse_labels(field, 1), field.labels);
    EXPECT_EQ(coarse_labels(field, 2), (std::vector<std::uint8_t>{0, 2, 8, 1}));
    EXPECT_EQ(coarse_labels(field, 4), (std::vector<std::uint8_t>{0}));
}

/// Variances of what the regions' models add up to, [level][region][plane], over the residual's.
std::vector<double> proportions(GainMode gains) {
    constexpr int levels = 3, seeds = 8;
    Device& device = test::default_device();
    Image image = read_picture(test::data_folder() + "/bark.png").image;
    ClusterOptions clusters;
    clusters.regions = 3;
    const ControlField field = cluster(image, clusters).field;
    const Image mean = conditional_mean(device.impl(), fit_conditional_mean(image, field), field);
    for (size_t i = 0; i < image.values().size(); ++i) image.values()[i] -= mean.values()[i];
    FitOptions local = CompoundOptions::local_defaults();
    local.levels = levels;
    local.gains = gains;
    local.marginals = MarginalMode::none;
    const RegionalFit fit = fit_regions(device, image, image, field, local, AveragesEstimator::spectral_root);
    const auto variances = [&](const Image& of) {
        std::vector<double> result;
        int step = 1;
        for (const Image& level : decompose(device, of, levels, 2)) {
            const std::vector<double> own =
                regional_variances(level, coarse_labels(field, step), field.regions);
            result.insert(result.end(), own.begin(), own.end());
            step *= 2;
        }
        return result;
    };
    std::vector<const TextureModel*> regions;
    for (const TextureModel& residual : fit.residuals) regions.push_back(&residual);
    RegionalFields fields(device.impl(), regions, field.size);
    EXPECT_EQ(fields.layout().lattice, field.size);
    const Buffer labels = device.impl().upload(field.labels);
    std::vector<double> sums(static_cast<size_t>(levels * field.regions * image.planes()), 0.0);
    for (std::uint32_t seed = 0; seed < seeds; ++seed) {
        const Buffer keys = device.impl().upload(std::vector<std::array<std::uint32_t, 2>>{{seed, 77U}});
        const DevicePlanes grown = fields.grow(labels, keys);
        Image texture(grown.lattice, grown.planes);
        device.impl().read(grown.values, texture.values().data(), texture.values().size_bytes());
        const std::vector<double> own = variances(texture);
        for (size_t n = 0; n < sums.size(); ++n) sums[n] += own[n] / seeds;
    }
    const std::vector<double> wanted = variances(image);
    for (size_t n = 0; n < sums.size(); ++n) sums[n] /= wanted[n];
    return sums;
}

TEST(RegionalGains, LevelsHaveThePicturesProportions) {
    // In the coarsest level the smaller region has mostly what its neighbours' fields bring along.
    const auto worst = [](GainMode gains) {
        const std::vector<double> all = proportions(gains);
        double result = 0.0;
        for (size_t n = 0; n < 18; ++n) result = std::max(result, std::abs(all[n] - 1.0));
        return result;
    };
    EXPECT_LT(worst(GainMode::match), 0.07);
    EXPECT_GT(worst(GainMode::none), 0.2);
}

}  // namespace
}  // namespace btfield
