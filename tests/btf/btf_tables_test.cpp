// host/btf/btf_tables.cpp, plane_tone.cpp, direction_table.cpp and direction_interpolation.cpp.

#include "host/btf/btf_tables.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "host/btf/direction_table.hpp"

namespace btfield {
namespace {

TEST(BtfTables, TonesHaveTheirContrast) {
    // Values that are not normally distributed at all.
    for (const float heavy : {-2.5F, 0.4F, 2.5F}) {
        std::vector<float> t;
        for (int i = 0; i < 400; ++i)
            t.push_back(i % 5 == 0 ? heavy : 0.3F * static_cast<float>(i % 7) - 1.0F);
        const detail::PlaneDistribution of(t);
        for (const double contrast : {0.01, 0.3, 0.8, 1.2}) {
            const detail::PlaneTone tone = of.tone(contrast);
            double sum = 0.0, squares = 0.0;
            for (const float v : t) {
                const double z = std::max(0.0, tone.offset + tone.slope * static_cast<double>(v));
                sum += z * z / 400.0;
                squares += z * z * z * z / 400.0;
            }
            EXPECT_NEAR(sum, 1.0, 2e-3) << heavy << " " << contrast;
            EXPECT_NEAR(std::sqrt(squares - sum * sum), contrast, 5e-3 * contrast) << heavy;
        }
        EXPECT_EQ(of.tone(0.0).slope, 0.0);
        // More than any depth has: the deepest there is.
        EXPECT_GT(of.tone(50.0).slope, of.tone(0.8).slope);
    }
    EXPECT_EQ(detail::PlaneDistribution(std::vector<float>(9, 0.7F)).tone(0.5).slope, 0.0);
    EXPECT_EQ(detail::kept_contrast(0.4, 0.2), 0);
    EXPECT_EQ(detail::kept_contrast(0.4 * std::pow(4.0, 10.3 / 127.0), 0.2), 10);
    EXPECT_EQ(detail::kept_contrast(100.0, 0.2), 127);
    EXPECT_EQ(detail::kept_contrast(0.0, 0.2), 0);
    EXPECT_EQ(detail::kept_contrast(0.3, 0.0), 0);
}

TEST(BtfTables, MeansAreHalvesWhereHalvesSuffice) {
    const auto rounded = [](std::vector<float> means) {
        detail::round_means(means);
        return means;
    };
    EXPECT_EQ(rounded({1.0F + 0x1p-11F, 1.0F + 0x1.8p-10F, 1e-6F}),
              (std::vector<float>{1.0F, 1.0F + 0x1p-9F, 0x11p-24F}));
    // What halves cannot hold is left as it is.
    for (const std::vector<float>& means : {std::vector<float>{3e5F, 1.0F + 0x1p-11F}, {3.3e-9F, 0.0F}})
        EXPECT_EQ(rounded(means), means);
}

/// Tables of one plane whose values are functions of directions.
BtfModel table_model() {
    BtfModel model;
    model.colours = 1;
    model.views = model.lights = btf_directions_81();
    model.tables.weight_units = {1e-2};
    for (int v = 0; v < 81; v += 2)
        for (int l = 0; l < 81; ++l) {
            model.pairs.push_back({v, l});
            const auto view = model.views[static_cast<std::size_t>(v)];
            const auto light = model.lights[static_cast<std::size_t>(l)];
            model.tables.mean.push_back(static_cast<float>(std::cos(light.theta) * (0.5 + 0.2 * view.theta)));
            model.tables.contrast.push_back(static_cast<std::int8_t>(
                std::lround(40.0 * (view.theta * std::cos(view.phi) -
                                    0.3 * std::tan(light.theta) * std::sin(light.phi)))));
            model.tables.weights.push_back(1);
        }
    model.tables.kept.resize(model.pairs.size());
    std::iota(model.tables.kept.begin(), model.tables.kept.end(), 0U);
    return model;
}

TEST(DirectionTable, MeasuredDirectionsAreThemselvesAndOthersInBetween) {
    const BtfModel model = table_model();
    const detail::DirectionTable table(model);
    for (std::size_t pair = 0; pair < model.pairs.size(); pair += 97) {
        const auto view = model.views[static_cast<std::size_t>(model.pairs[pair].view)];
        const auto at = table.measured().interpolate({view, detail::light_of(model, pair)});
        // From above, phi means nothing.
        ASSERT_EQ(at.size(), 1U);
        EXPECT_EQ(at.front().weight, 1.0);
    }
    for (const auto& [view, light] : {std::pair(BtfDirection{0.3, 1.0}, BtfDirection{0.7, 5.0}),
                                      std::pair(BtfDirection{1.2, 3.0}, BtfDirection{1.0, 3.1}),
                                      std::pair(BtfDirection{0.9, 6.2}, BtfDirection{0.1, 0.4})}) {
        const auto weights = table.measured().interpolate({view, light});
        double sum = 0.0;
        for (const auto& each : weights) sum += each.weight;
        EXPECT_NEAR(sum, 1.0, 1e-6);
        const detail::PictureWeights found = table.weights(view, light);
        // Linear in the coordinates: exact but for rounding.
        const double units =
            40.0 * (view.theta * std::cos(view.phi) - 0.3 * std::tan(light.theta) * std::sin(light.phi));
        EXPECT_NEAR(std::log(found.contrast[0] / 0.02) / std::log(4.0) * 127.0, units, 0.5);
        // The picture of normally distributed planes has that contrast: var z² = 4 m² u² + 2 u⁴, m² + u² = 1.
        const double u = found.weights[0], m = found.offsets[0];
        EXPECT_NEAR(m * m + u * u, 1.0, 1e-3);
        EXPECT_NEAR(std::sqrt(4.0 * m * m * u * u + 2.0 * u * u * u * u), found.contrast[0],
                    2e-3 * found.contrast[0]);
        const double mean = std::cos(light.theta) * (0.5 + 0.2 * view.theta);
        EXPECT_NEAR(found.mean[0], mean, 0.03 * mean);
    }
    // Beyond the outermost ring, what the ring has.
    const auto beyond = table.weights({1.5, 0.0}, {1.5, 0.0});
    const auto rim =
        table.weights({75.0 * std::numbers::pi / 180.0, 0.0}, {75.0 * std::numbers::pi / 180.0, 0.0});
    EXPECT_EQ(beyond.mean[0], rim.mean[0]);
}

TEST(DirectionTable, FewDirectionsWillDo) {
    BtfModel model = table_model();
    // One view only: nothing is known along views.
    std::erase_if(model.pairs, [](const BtfPair& pair) { return pair.view != 0; });
    const std::size_t kept = model.pairs.size();
    model.tables.mean.resize(kept);
    model.tables.kept.resize(kept);
    model.tables.contrast.resize(kept);
    model.tables.weights.resize(kept);
    const detail::DirectionTable table(model);
    const auto found = table.weights({0.8, 1.0}, {0.5, 2.0});
    EXPECT_TRUE(std::isfinite(found.mean[0]));
    EXPECT_GT(found.weights[0], 0.0);
    model.pairs.resize(1);
    model.tables.mean.resize(1);
    model.tables.kept.resize(1);
    model.tables.contrast.resize(1);
    model.tables.weights.resize(1);
    EXPECT_NEAR(detail::DirectionTable(model).weights({0.8, 1.0}, {0.0, 2.0}).mean[0], 0.5, 1e-3);
}
}  // namespace
}  // namespace btfield
