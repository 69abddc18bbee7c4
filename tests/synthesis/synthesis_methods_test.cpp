// Ways to grow the same model: raster recursion beside the torus, convolution beside the transfer function.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "btfield/pyramid.hpp"
#include "btfield/synthesis.hpp"
#include "btfield/theory.hpp"
#include "host/synthesis/independent_planes.hpp"
#include "tests/example_model.hpp"
#include "tests/linear_field_cases.hpp"

namespace btfield {

using namespace detail;

namespace {

using std::size_t;

/// A model whose coefficients' absolute values sum to 0.8 in every row, so that it is stable and neighbours
/// correlate, and whose values spread over about [0, 1].
TextureModel model_with(ModelKind kind, int planes, int levels, NeighbourhoodKind support, int order = 2) {
    TextureModel model = test::example_model(kind, planes, levels);
    unsigned seed = 1;
    for (LevelModel& level : model.levels)
        for (Model& part : level.models) {
            std::vector<Offset> offsets = neighbourhood(order, support);
            if (family(kind) == Family::ma) offsets.push_back({});
            LinearField field = test::random_field(offsets, is_2d(kind) ? 1 : planes, 0.8, true, seed++);
            field.kind = support;
            for (double& value : field.noise_covariance) value *= 0.02;
            part = model_of(family(kind), std::move(field));
        }
    return model;
}

std::vector<std::uint64_t> seeds_from(std::uint64_t first, int count) {
    std::vector<std::uint64_t> seeds(static_cast<size_t>(count));
    std::iota(seeds.begin(), seeds.end(), first);
    return seeds;
}

SynthesisOptions raster() {
    SynthesisOptions options;
    options.method = SynthesisMethod::raster;
    return options;
}

SynthesisOptions moving_average(MovingAverageRoute route, NoiseDomain domain = NoiseDomain::spatial) {
    SynthesisOptions options;
    options.noise_domain = domain;
    options.moving_average = route;
    return options;
}

bool same_bits(const Image& a, const Image& b) {
    return a.size() == b.size() && a.planes() == b.planes() &&
           std::memcmp(a.values().data(), b.values().data(), a.values().size_bytes()) == 0;
}

/// Largest difference between a and the part of b that begins at its first pixel; NaN counts as infinite.
double largest_difference(const Image& a, const Image& b) {
    double largest = 0.0;
    for (int p = 0; p < a.planes(); ++p)
        for (int r = 0; r < a.height(); ++r)
            for (int c = 0; c < a.width(); ++c) {
                const double difference =
                    std::abs(static_cast<double>(a.at(p, r, c)) - static_cast<double>(b.at(p, r, c)));
                if (!(difference <= largest)) largest = std::isnan(difference) ? INFINITY : difference;
            }
    return largest;
}

// Covariance
// ----------------------------------------------------------------------------------------------------

/// C_ij(s) about the model's mean, over pixels whose neighbour at s lies inside: 8 to H − 8, which are as
/// many of every phase of a pyramid with a factor of 2 and up to 4 levels.
double covariance_inside(const Image& image, const std::vector<double>& mean, int i, int j, Offset s) {
    double sum = 0.0;
    int count = 0;
    for (int r = 8; r < image.height() - 8; ++r)
        for (int c = 8; c < image.width() - 8; ++c, ++count)
            sum += (image.at(i, r, c) - mean[static_cast<size_t>(i)]) *
                   (image.at(j, r + s.row, c + s.column) - mean[static_cast<size_t>(j)]);
    return sum / count;
}

/// The mean over many seeds of every covariance lies within 4.5 of its standard errors of theory.
/// \param torus  of the theory: large where the textures are cut out of an endless field
void expect_theory(const TextureModel& model, const SynthesisOptions& options, Size torus) {
    const Size size{64, 80};
    Device device;
    Synthesiser synthesiser(device, model, size, options);
    const std::vector<Offset> lags = {{0, 0}, {0, 1}, {1, 0}, {1, 1}, {2, -1}, {0, 5}};
    const std::vector<double> theory = theoretical_covariance(model, torus, lags);
    const int count = 32;
    const std::vector<Image> textures = synthesiser.synthesise(seeds_from(100, count));
    const auto d = static_cast<size_t>(model.planes);
    for (size_t l = 0; l < lags.size(); ++l)
        for (size_t i = 0; i < d; ++i)
            for (size_t j = 0; j < d; ++j) {
                double sum = 0.0, squares = 0.0;
                for (const Image& texture : textures) {
                    const double c = covariance_inside(texture, model.mean, static_cast<int>(i),
                                                       static_cast<int>(j), lags[l]);
                    sum += c;
                    squares += c * c;
                }
                const double mean = sum / count;
                const double error = std::sqrt(std::max(0.0, squares / count - mean * mean) / (count - 1.0));
                // A recursion begins so far outside that at most 1e-3 of the variance is missing.
                const double missing = 1e-3 * std::sqrt(theory[i * d + i] * theory[j * d + j]);
                EXPECT_LE(std::abs(mean - theory[(l * d + i) * d + j]), 4.5 * error + missing)
                    << "lag " << lags[l].row << ", " << lags[l].column << " of planes " << i << ", " << j
                    << ": " << mean << " instead of " << theory[(l * d + i) * d + j];
            }
}

TEST(SynthesisMethods, RasterHasTheCovarianceOfTheTorus) {
    for (const ModelKind kind : {ModelKind::car3d, ModelKind::car2d})
        for (const int levels : {1, 3}) {
            SCOPED_TRACE(std::string(name(kind)) + ", levels " + std::to_string(levels));
            expect_theory(model_with(kind, 2, levels, NeighbourhoodKind::causal), raster(), {128, 128});
        }
}

TEST(SynthesisMethods, ConvolutionHasTheModelsCovariance) {
    for (const ModelKind kind : {ModelKind::ma3d, ModelKind::ma2d}) {
        SCOPED_TRACE(name(kind));
        expect_theory(model_with(kind, 2, 2, NeighbourhoodKind::symmetric),
                      moving_average(MovingAverageRoute::convolution), {64, 80});
    }
}

// Raster
// --------------------------------------------------------------------------------------------------------

TEST(SynthesisMethods, RasterTexturesAreTheBeginningOfAnEndlessOne) {
    // A quarter-plane recursion does not know what will be to its right and below, and noise does not depend
    // on the size: only a pyramid level that wrapped into the texture would.
    Device device;
    for (const int factor : {2, 3}) {
        SCOPED_TRACE(factor);
        TextureModel model = model_with(ModelKind::car3d, 2, 3, NeighbourhoodKind::unilateral);
        model.factor = factor;
        const std::vector<Size> sizes = pyramid_sizes(model.size, 3, factor);
        for (size_t k = 0; k < sizes.size(); ++k) model.levels[k].size = sizes[k];
        const Image small = Synthesiser(device, model, {23, 31}, raster()).synthesise(5);
        const Image large = Synthesiser(device, model, {70, 64}, raster()).synthesise(5);
        // Sums in the same order; what contraction to other instructions at edges may change is rounding.
        EXPECT_LE(largest_difference(small, large), 1e-6);
    }
}

TEST(SynthesisMethods, RasterBatchEqualsSingleSeedsBitForBit) {
    Device device;
    const TextureModel model = model_with(ModelKind::car2d, 3, 2, NeighbourhoodKind::causal);
    Synthesiser synthesiser(device, model, {33, 21}, raster());
    const std::vector<std::uint64_t> seeds = seeds_from(7, 5);
    const std::vector<Image> batch = synthesiser.synthesise(seeds);
    for (size_t i = 0; i < seeds.size(); ++i)
        EXPECT_TRUE(same_bits(batch[i], synthesiser.synthesise(seeds[i]))) << i;
    EXPECT_FALSE(same_bits(batch[0], batch[1]));
}

TEST(SynthesisMethods, RasterDoesNotTile) {
    Device device;
    const TextureModel flat = model_with(ModelKind::car3d, 1, 1, NeighbourhoodKind::causal);
    const Synthesiser one(device, flat, {17, 19}, raster());
    EXPECT_FALSE(one.tileable());
    EXPECT_EQ(one.lattice(), (Size{17, 19}));
    EXPECT_EQ(one.size(), (Size{17, 19}));
    EXPECT_TRUE(Synthesiser(device, flat, {16, 16}).tileable());
    // Two levels: 1 pixel spoilt at the beginning, 2 at the end, then whole pairs.
    const TextureModel two = model_with(ModelKind::car3d, 1, 2, NeighbourhoodKind::causal);
    EXPECT_EQ(Synthesiser(device, two, {16, 17}, raster()).lattice(), (Size{20, 20}));
}

template <class Work>
std::string refusal(Work work) {
    try {
        work();
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

TEST(SynthesisMethods, RasterIsForCausalModels) {
    for (const ModelKind kind : model_kinds()) {
        if (family(kind) == Family::car) continue;
        const TextureModel model = test::example_model(kind);
        const std::string message = refusal([&] { check_synthesis(model, {16, 16}, raster()); });
        EXPECT_NE(message.find(name(kind)), std::string::npos) << message;
        EXPECT_NE(message.find("--method torus"), std::string::npos) << message;
    }
}

TEST(SynthesisMethods, UnstableRecursionsAreRefusedWhateverTheCertificate) {
    TextureModel model = model_with(ModelKind::car2d, 2, 2, NeighbourhoodKind::causal);
    check_synthesis(model, {16, 16}, raster());
    LinearField growing = linear_field(model.levels[1].models[1]);
    std::fill(growing.coefficients.begin(), growing.coefficients.end(), 0.0);
    growing.coefficients.front() = 1.01;  // det Λ = 1 − 1.01 e^{√−1 ω·s} has no zero on the torus
    model.levels[1].models[1] = CarModel{growing};
    SynthesisOptions insisting = raster();
    insisting.allow_invalid = true;
    Device device;
    for (const SynthesisOptions& options : {raster(), insisting}) {
        const std::string checked = refusal([&] { check_synthesis(model, {16, 16}, options); });
        EXPECT_NE(checked.find("level 1"), std::string::npos) << checked;
        EXPECT_NE(checked.find("--method torus"), std::string::npos) << checked;
        EXPECT_EQ(refusal([&] { Synthesiser(device, model, {16, 16}, options); }), checked);
    }
    check_synthesis(model, {16, 16});
}

TEST(SynthesisMethods, SaysWhatFitsWhenMemoryDoesNot) {
    Device device;
    const TextureModel causal = model_with(ModelKind::car3d, 3, 2, NeighbourhoodKind::causal);
    const TextureModel average = model_with(ModelKind::ma3d, 3, 2, NeighbourhoodKind::symmetric);
    const Size size{1 << 19, 1 << 19};
    try {
        const Synthesiser synthesiser(device, causal, size, raster());
        FAIL() << "12 TB of device memory?";
    } catch (const DeviceError& error) {
        EXPECT_NE(error.remedy().find("a size up to about"), std::string::npos) << error.what();
        EXPECT_EQ(error.remedy().find("about 0x0"), std::string::npos) << error.what();
    }
    EXPECT_THROW(Synthesiser(device, average, size, moving_average(MovingAverageRoute::convolution)),
                 DeviceError);
}

TEST(SynthesisMethods, PlanesJoinOnAllOffsets) {
    LinearField first = test::random_field({{0, -1}, {-1, 0}}, 1, 0.5), second = first;
    second.offsets = {{-1, 0}, {-1, 2}};
    second.coefficients = {0.25, -0.125};
    second.noise_covariance = {3.0};
    const std::vector<Model> models{CarModel{first}, CarModel{second}};
    const LinearField joined = joined_planes(models);
    EXPECT_EQ(joined.planes, 2);
    EXPECT_EQ(joined.offsets, (std::vector<Offset>{{-1, 0}, {-1, 2}, {0, -1}}));
    const std::vector<LinearField> parts = independent_planes(joined);
    ASSERT_EQ(parts.size(), 2U);
    EXPECT_EQ(parts[0].coefficients,
              (std::vector<double>{first.coefficients[1], 0.0, first.coefficients[0]}));
    EXPECT_EQ(parts[1].coefficients, (std::vector<double>{0.25, -0.125, 0.0}));
    EXPECT_EQ(parts[0].noise_covariance, first.noise_covariance);
    EXPECT_EQ(parts[1].noise_covariance, second.noise_covariance);
}

// Moving averages
// -----------------------------------------------------------------------------------------------

TEST(SynthesisMethods, ConvolutionAndTransferFunctionAgree) {
    Device device;
    // The prime is computed on a larger lattice, whichever way.
    for (const Size size : {Size{33, 40}, Size{17, 64}})
        for (const ModelKind kind : {ModelKind::ma3d, ModelKind::ma2d})
            for (const int levels : {1, 2}) {
                SCOPED_TRACE(std::string(name(kind)) + ", levels " + std::to_string(levels));
                const TextureModel model = model_with(kind, 3, levels, NeighbourhoodKind::symmetric);
                const auto grown = [&](MovingAverageRoute route) {
                    return Synthesiser(device, model, size, moving_average(route)).synthesise(3);
                };
                const Image convolved = grown(MovingAverageRoute::convolution);
                // Of full scale, which is 1.
                EXPECT_LE(largest_difference(convolved, grown(MovingAverageRoute::transfer)), 1e-5);
                EXPECT_FALSE(same_bits(convolved, grown(MovingAverageRoute::transfer)));
            }
}

TEST(SynthesisMethods, SmallSupportsAreConvolved) {
    Device device;
    // 13 and 45 offsets of 3 coupled planes, or of planes on their own.
    struct Case {
        ModelKind kind;
        int order;
        MovingAverageRoute expected;
    };
    for (const Case& c : {Case{ModelKind::ma3d, 3, MovingAverageRoute::convolution},
                          Case{ModelKind::ma3d, 8, MovingAverageRoute::transfer},
                          Case{ModelKind::ma2d, 8, MovingAverageRoute::convolution}}) {
        SCOPED_TRACE(std::string(name(c.kind)) + ", order " + std::to_string(c.order));
        const TextureModel model = model_with(c.kind, 3, 1, NeighbourhoodKind::symmetric, c.order);
        const auto grown = [&](MovingAverageRoute route) {
            return Synthesiser(device, model, {32, 32}, moving_average(route)).synthesise(3);
        };
        EXPECT_TRUE(same_bits(grown(MovingAverageRoute::automatic), grown(c.expected)));
    }
}

TEST(SynthesisMethods, NoiseDrawnInFrequencyIsNotConvolved) {
    Device device;
    const TextureModel model = model_with(ModelKind::ma3d, 2, 1, NeighbourhoodKind::symmetric);
    const auto grown = [&](MovingAverageRoute route) {
        return Synthesiser(device, model, {32, 32}, moving_average(route, NoiseDomain::frequency))
            .synthesise(3);
    };
    const Image image = grown(MovingAverageRoute::automatic);
    EXPECT_TRUE(same_bits(image, grown(MovingAverageRoute::convolution)));
    EXPECT_TRUE(same_bits(image, grown(MovingAverageRoute::transfer)));
}

}  // namespace
}  // namespace btfield
