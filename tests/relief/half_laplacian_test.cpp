#include "host/relief/half_laplacian.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "btfield/error.hpp"
#include "tests/device_cases.hpp"

namespace btfield {

using namespace detail;

namespace {

/// A wave of r and c turns over the picture, half-way between pixels where it is mirrored.
Image wave(Size size, int r, int c, bool mirror) {
    Image image(size, 1);
    const double turn = mirror ? std::numbers::pi : 2.0 * std::numbers::pi;
    const double shift = mirror ? 0.5 : 0.0;
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x)
            image.at(0, y, x) = static_cast<float>(std::cos(turn * r * (y + shift) / size.height) *
                                                   std::cos(turn * c * (x + shift) / size.width));
    return image;
}

class HalfLaplacianSmall : public testing::TestWithParam<int> {
  protected:
    Device device_ = test::device_of_width(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Widths, HalfLaplacianSmall, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(HalfLaplacianSmall, MultipliesWavesByTheRootOfTheirLaplacian) {
    for (const bool mirror : {false, true})
        for (const auto& [r, c] : {std::pair{0, 3}, {2, 0}, {5, 1}, {7, 7}}) {
            const Size size{20, 24};
            const Image image = wave(size, r, c, mirror);
            const double half = mirror ? 0.5 : 1.0;
            const double mu = std::pow(2.0 * std::sin(half * std::numbers::pi * r / size.height), 2) +
                              std::pow(2.0 * std::sin(half * std::numbers::pi * c / size.width), 2);
            const SurfaceEdges edges = mirror ? SurfaceEdges::mirror : SurfaceEdges::periodic;
            const Image found = half_laplacian(device_.impl(), image, edges);
            const Image back = inverse_half_laplacian(device_.impl(), found, edges);
            for (std::size_t i = 0; i < image.values().size(); ++i) {
                ASSERT_NEAR(found.values()[i], std::sqrt(mu) * static_cast<double>(image.values()[i]), 1e-5)
                    << mirror << r << c;
                ASSERT_NEAR(back.values()[i], image.values()[i], 2e-5) << mirror << r << c;
            }
        }
}

TEST_P(HalfLaplacianSmall, MeansAreTakenAway) {
    Image level({8, 12}, 1);
    for (float& value : level.values()) value = 3.0F;
    for (const SurfaceEdges edges : {SurfaceEdges::periodic, SurfaceEdges::mirror}) {
        const Image found = half_laplacian(device_.impl(), level, edges);
        const Image back = inverse_half_laplacian(device_.impl(), level, edges);
        for (const float value : found.values()) EXPECT_NEAR(value, 0.0, 1e-5);
        for (const float value : back.values()) EXPECT_NEAR(value, 0.0, 1e-5);
    }
}

TEST(HalfLaplacian, SidesWithoutFastTransform) {
    DeviceImpl& device = test::default_device().impl();
    const Image image = wave({34, 37}, 3, 2, true);
    EXPECT_THROW(static_cast<void>(half_laplacian(device, image, SurfaceEdges::periodic)), InputError);
    // Mirrored, it goes on over 70 x 75 pixels, where the pattern of 68 x 74 does not close.
    const Image back = inverse_half_laplacian(device, half_laplacian(device, image, SurfaceEdges::mirror),
                                              SurfaceEdges::mirror);
    double squares = 0.0;
    for (std::size_t i = 0; i < image.values().size(); ++i)
        squares += std::pow(static_cast<double>(back.values()[i] - image.values()[i]), 2);
    EXPECT_LT(std::sqrt(squares / static_cast<double>(image.values().size())), 0.05);
}

}  // namespace
}  // namespace btfield
