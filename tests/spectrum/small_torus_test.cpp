#include "host/spectrum/small_torus.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "btfield/synthesis.hpp"
#include "btfield/theory.hpp"
#include "host/spectrum/spectral_density.hpp"
#include "tests/device_cases.hpp"

namespace btfield {

using namespace detail;

namespace {

/// Two planes that correlate over some ten pixels.
CarModel far_reaching() {
    CarModel car;
    car.kind = NeighbourhoodKind::custom;
    car.planes = 2;
    car.offsets = {{-1, -1}, {-1, 0}, {0, -1}};
    // (1 − a z1)(1 − a z2), a = 0.9 and 0.85; the second plane drives the first a little.
    car.coefficients = {-0.81, 0.0, 0.0, -0.7225, 0.9, 0.0, 0.0, 0.85, 0.9, 0.01, 0.0, 0.85};
    car.noise_covariance = {0.01, 0.008, 0.008, 0.02};
    return car;
}

TextureModel model_of(int levels) {
    TextureModel model;
    model.kind = ModelKind::car3d;
    model.planes = 2;
    model.size = {128, 128};
    model.mean = {0.5, -0.25};
    for (int k = 0; k < levels; ++k) {
        LevelModel level;
        level.size = {128 >> k, 128 >> k};
        level.models = {far_reaching()};
        level.gain = k + 1 == levels ? 1.0 : 0.2;
        level.certificate = {.valid = true, .min_singular = 0.02, .variance_ratio = {1.0, 1.0}};
        model.levels.push_back(level);
    }
    return model;
}

TEST(SmallTorus, VarianceIsThatOfTheInfiniteLattice) {
    const SpectralForm form = far_reaching();
    const Eigen::MatrixXd wanted = spectral_means(form, {1024, 1024}).covariance;
    for (const Size torus : {Size{1, 1}, Size{2, 3}, Size{8, 8}, Size{12, 7}}) {
        const auto mean = mean_density(form, torus, 2, 0);
        ASSERT_TRUE(mean);
        const Eigen::MatrixXd sampled = spectral_means(form, torus).covariance;
        const Eigen::MatrixXd grown =
            sampled + (*mean - density_at_zero(form)) / static_cast<double>(area(torus));
        EXPECT_GT((sampled - wanted).norm(), 0.2 * wanted.norm()) << torus.height;
        // The integral's own error.
        EXPECT_LT((grown - wanted).norm(), 1e-3 * wanted.norm()) << torus.height;
    }
    EXPECT_FALSE(mean_density(form, {32, 32}, 2, 0));
}

TEST(SmallTorus, ShortCorrelationsAreTakenAsTheyAre) {
    CarModel car = far_reaching();
    for (double& a : car.coefficients) a *= 0.3;
    EXPECT_FALSE(mean_density(car, {8, 8}, 2, 0));
}

TEST(SmallTorus, TexturesHaveTheDeviationOfLargeOnes) {
    Device device = test::device_of_width(16);
    for (const int levels : {1, 3}) {
        const TextureModel model = model_of(levels);
        const std::vector<double> wanted = theoretical_deviation(model, {512, 512});
        for (const Size size : {Size{4, 4}, Size{16, 8}}) {
            const std::vector<double> promised = theoretical_deviation(model, size);
            Synthesiser synthesiser(device, model, size);
            std::vector<std::uint64_t> seeds(2000);
            for (std::size_t i = 0; i < seeds.size(); ++i) seeds[i] = i;
            std::vector<double> squares(2);
            for (const Image& texture : synthesiser.synthesise(seeds))
                for (int p = 0; p < 2; ++p)
                    for (const float v : texture.plane(p))
                        squares[static_cast<std::size_t>(p)] +=
                            std::pow(v - model.mean[static_cast<std::size_t>(p)], 2);
            for (std::size_t p = 0; p < 2; ++p) {
                const double found = std::sqrt(squares[p] / static_cast<double>(area(size) * seeds.size()));
                // A texture has at least one degree of freedom: 4 deviations of √(1 / (2 · 2000)).
                EXPECT_NEAR(found / promised[p], 1.0, 0.065) << levels << ' ' << size.height;
                // Levels whose torus is a pixel still wrap.
                EXPECT_NEAR(promised[p] / wanted[p], 1.0, 0.03) << levels << ' ' << size.height;
            }
        }
    }
}

}  // namespace
}  // namespace btfield
