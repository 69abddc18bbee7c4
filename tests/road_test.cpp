// The whole road on pictures so small that Oclgrind and the sanitizers can walk it: picture, fit, model file,
// synthesis.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "btfield/fit.hpp"
#include "btfield/model_file.hpp"
#include "btfield/synthesis.hpp"

namespace btfield {
namespace {

/// Correlated planes with a range of about two pixels: each pixel a weighted sum of white noise around it.
Image texture(Size size, int planes) {
    std::mt19937 generator(7);
    std::normal_distribution<float> normal(0.0F, 0.1F);
    Image noise(size, planes + 1);
    for (float& value : noise.values()) value = normal(generator);
    Image image(size, planes);
    for (int p = 0; p < planes; ++p)
        for (int r = 0; r < size.height; ++r)
            for (int c = 0; c < size.width; ++c) {
                const int right = (c + 1) % size.width, below = (r + 1) % size.height;
                image.at(p, r, c) = 0.5F + noise.at(p, r, c) + 0.5F * noise.at(p, r, right) +
                                    0.4F * noise.at(p, below, c) + 0.6F * noise.at(planes, r, c);
            }
    return image;
}

struct Case {
    const char* name;
    int planes, levels;
    Size size;  ///< of the texture to grow
    NoiseDomain domain = NoiseDomain::frequency;
    ModelKind kind = ModelKind::car3d;
    SynthesisMethod method = SynthesisMethod::torus;
};

// Lengths of transforms are few, because each is a kernel of its own to compile.
const Case colour{"colour, two levels", 3, 2, {16, 16}};
const Case cropped{"cropped, noise on the lattice", 1, 1, {17, 15}, NoiseDomain::spatial};
const Case recursion{
    "recursion", 2, 1, {5, 18}, NoiseDomain::frequency, ModelKind::car2d, SynthesisMethod::raster};
const Case convolution{"convolution", 2, 1, {8, 16}, NoiseDomain::spatial, ModelKind::ma3d};
const Case others[] = {
    {"four planes", 4, 1, {8, 16}}, {"six planes", 6, 1, {8, 16}}, {"single pixel", 1, 1, {1, 1}},
    {"row", 1, 1, {1, 16}},         {"column", 1, 1, {15, 1}},
};

TextureModel fitted(Device& device, const Case& what) {
    FitOptions options;
    options.model = what.kind;
    options.order = 1;
    options.levels = what.levels;
    return from_json(to_json(fit(device, texture({24, 20}, what.planes), options)));
}

Image grown(Device& device, const Case& what) {
    SynthesisOptions options;
    options.noise_domain = what.domain;
    options.method = what.method;
    Synthesiser synthesiser(device, fitted(device, what), what.size, options);
    const std::uint64_t seeds[] = {1, 2};
    return synthesiser.synthesise(seeds).back();
}

/// Kernels of this project only: what clFFT launches is its own business, and too long for Oclgrind.
DeviceOptions own_kernels() {
    DeviceOptions options;
    options.fft = FftBackend::lanes;
    return options;
}

TEST(Road, LaunchesKernels) {
    DeviceOptions options = own_kernels();
    options.profile = true;
    Device device("", options);
    ASSERT_EQ(device.launch_count(), 0U);
    (void)grown(device, colour);

    const std::vector<ProfileEntry> profile = device.take_profile();
    const int launches =
        std::accumulate(profile.begin(), profile.end(), 0,
                        [](int sum, const ProfileEntry& entry) { return sum + entry.launches; });
    EXPECT_GT(launches, 0);
    EXPECT_EQ(device.launch_count(), static_cast<std::uint64_t>(launches));
}

TEST(Road, WidthsAgree) {
    for (const Case& what : {colour, cropped, recursion, convolution}) {
        SCOPED_TRACE(what.name);
        Image reference;
        for (const int width : {1, 4}) {  // the others: synthesis_test.cpp
            SCOPED_TRACE("vector width " + std::to_string(width));
            DeviceOptions options = own_kernels();
            options.vector_width = width;
            Device device("", options);
            ASSERT_EQ(device.vector_width(), width);
            const Image image = grown(device, what);
            ASSERT_EQ(image.size(), what.size);
            ASSERT_EQ(image.planes(), what.planes);
            if (width == 1) reference = image;
            // Results are promised to 1e-5 of full scale, which is 1, on any device and width; NaN fails.
            for (std::size_t i = 0; i < image.values().size(); ++i)
                ASSERT_LE(std::abs(image.values()[i] - reference.values()[i]), 1e-5F) << "value " << i;
        }
    }
}

TEST(Road, EveryShapeArrives) {
    Device device("", own_kernels());
    for (const Case& what : others) {
        SCOPED_TRACE(what.name);
        const Image image = grown(device, what);
        ASSERT_EQ(image.size(), what.size);
        ASSERT_EQ(image.planes(), what.planes);
        // Mean 0.5 and deviation about 0.15: 6 deviations and what 24 × 20 pixels leave open about both.
        for (const float value : image.values()) ASSERT_LE(std::abs(value - 0.5F), 1.5F);
    }
}

TEST(Road, MeanAndDeviationFollowTheModel) {
    // Hundreds of textures would be slow under Oclgrind; one of 64 × 64 bounds gross errors, and the
    // stations' own tests bound small ones. Independent values would scatter by 1/√n; neighbours correlate
    // over some 10 pixels, so n/10 values count, and 5 deviations of that are allowed.
    const Case what{"statistics", 3, 2, {64, 64}};
    Device device("", own_kernels());
    const Image source = texture({24, 20}, what.planes);
    const Image image = grown(device, what);
    const auto moments = [](std::span<const float> values) {
        double sum = 0, squares = 0;
        for (const float value : values) {
            sum += value;
            squares += static_cast<double>(value) * value;
        }
        const auto n = static_cast<double>(values.size());
        return std::pair(sum / n, std::sqrt(squares / n - sum / n * (sum / n)));
    };
    const double relative = 5.0 / std::sqrt(64.0 * 64.0 / 10.0);
    for (int p = 0; p < what.planes; ++p) {
        const auto [mean, deviation] = moments(source.plane(p));
        const auto [grown_mean, grown_deviation] = moments(image.plane(p));
        EXPECT_LE(std::abs(grown_mean - mean), relative * deviation);
        EXPECT_LE(std::abs(grown_deviation - deviation), relative * deviation);
    }
}

}  // namespace
}  // namespace btfield
