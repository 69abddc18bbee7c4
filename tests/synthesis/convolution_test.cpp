// kernels/synthesis/convolution.cl and host/synthesis/convolution.cpp.

#include "host/synthesis/convolution.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "btfield/error.hpp"
#include "host/spectrum/spectral_form.hpp"
#include "host/synthesis/independent_planes.hpp"
#include "host/synthesis/spectral_factors.hpp"
#include "tests/device_cases.hpp"
#include "tests/linear_field_cases.hpp"
#include "tests/reference/moving_average.hpp"

namespace btfield {

using namespace detail;

namespace {

using Reads = Convolution::Reads;

std::vector<Offset> support(int order) {
    std::vector<Offset> offsets = neighbourhood(order, NeighbourhoodKind::symmetric);
    offsets.push_back({});
    return offsets;
}

/// Fields of a batch, NaN where nothing was written; and the noise that they came from.
struct Drawn {
    std::vector<float> noise, images;
};

Drawn draw(Device& device, const LinearField& field, Size size, const std::vector<double>& mean, Reads reads,
           const std::vector<std::uint64_t>& seeds) {
    DeviceImpl& impl = device.impl();
    const int batch = static_cast<int>(seeds.size());
    const std::size_t count = area(size) * static_cast<std::size_t>(field.planes) * seeds.size();
    std::vector<float> values(count + 64, std::numeric_limits<float>::quiet_NaN());
    const Buffer keys = test::upload_seeds(device, seeds), images = impl.upload(values),
                 noise = impl.upload(std::vector<float>(count));
    draw_normal_field(impl, noise, keys, size, field.planes, batch, 2);
    Convolution(impl, field, size, 1.0, mean, reads).draw(impl, images, keys, batch, 2);
    Drawn result{test::read_all<float>(device, noise), test::read_all<float>(device, images)};
    for (std::size_t i = count; i < result.images.size(); ++i)
        EXPECT_TRUE(std::isnan(result.images[i])) << "written beyond the end: " << i - count;
    result.images.resize(count);
    return result;
}

void expect_reference(Device& device, const LinearField& field, Size size, Reads reads) {
    const auto d = static_cast<std::size_t>(field.planes);
    std::vector<double> mean;
    for (std::size_t i = 0; i < d; ++i) mean.push_back(0.5 + static_cast<double>(i));
    const Drawn drawn = draw(device, field, size, mean, reads, {7, 11});
    const std::size_t texture = d * area(size);
    for (std::size_t b = 0; b < 2; ++b) {
        const std::span<const float> noise(drawn.noise.data() + b * texture, texture);
        const std::vector<double> expected =
            reference::moving_average(field, symmetric_root(noise_matrix(field)), size, noise);
        // A sum of ηd products, each of a rounded coefficient: (ηd + 2) roundings of at most Σ |m n| <= 2 d ·
        // 6.7, the rows of |A| summing to 2 and those of |Σ^{1/2}| to at most d.
        const double products = static_cast<double>(field.offsets.size() * d);
        const double bound =
            test::unit_roundoff * (products + 2.0) * (2.0 * static_cast<double>(d) * 6.7 + 9.0);
        for (std::size_t k = 0; k < texture; ++k) {
            const double value = static_cast<double>(drawn.images[b * texture + k]);
            ASSERT_TRUE(std::abs(value - expected[k] - mean[k / area(size)]) <= bound)
                << test::text(size) << ", d = " << d << ", texture " << b << ", value " << k << ": " << value
                << " instead of " << expected[k] + mean[k / area(size)];
        }
    }
}

class ConvolutionSmall : public testing::TestWithParam<int> {
  protected:
    Device device_ = test::device_of_width(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Widths, ConvolutionSmall, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(ConvolutionSmall, AgreesOnOneTile) {
    for (const Reads reads : {Reads::direct, Reads::tiles})
        expect_reference(device_, test::random_field(support(1), 1, 2.0), {5, 18}, reads);
}

class ConvolutionWidths : public ConvolutionSmall {};
INSTANTIATE_TEST_SUITE_P(Widths, ConvolutionWidths, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(ConvolutionWidths, AgreesWithTheReference) {
    for (const int planes : test::plane_counts) {
        const LinearField field = test::random_field(support(planes == 1 ? 8 : 3), planes, 2.0);
        for (const Size size : test::lattice_sizes) {
            // Every size on one plane and three, a few on more.
            if (planes > 3 && area(size) > 300) continue;
            for (const Reads reads : {Reads::direct, Reads::tiles})
                expect_reference(device_, field, size, reads);
        }
    }
}

TEST_P(ConvolutionWidths, PlanesThatNothingCouplesAreComputedApart) {
    const LinearField field = test::random_field(support(2), 3, 2.0, false);
    EXPECT_EQ(independent_planes(field).size(), 3U);
    for (const Reads reads : {Reads::direct, Reads::tiles}) expect_reference(device_, field, {17, 31}, reads);
}

TEST_P(ConvolutionWidths, SupportsMayBeLopsidedAndLongerThanTheLattice) {
    const std::vector<Offset> offsets{{0, 0}, {0, 9}, {5, -40}, {-1, 3}, {11, 0}};
    for (const Size size : {Size{1, 1}, Size{4, 7}, Size{12, 20}})
        for (const Reads reads : {Reads::direct, Reads::tiles})
            expect_reference(device_, test::random_field(offsets, 3, 2.0), size, reads);
}

TEST(Convolution, BatchAndWorkGroupsChangeNothing) {
    Device device = test::device_of_width(8);
    const LinearField field = test::random_field(support(5), 3, 2.0);
    const Size size{33, 45};
    const std::vector<double> mean(3, 0.25);
    const std::vector<float> both = draw(device, field, size, mean, Reads::direct, {3, 4}).images;
    DeviceOptions options;
    options.vector_width = 8;
    options.work_group_size = 3;
    Device other({}, options);
    const std::vector<float> second = draw(other, field, size, mean, Reads::direct, {4}).images;
    EXPECT_TRUE(
        std::equal(second.begin(), second.end(), both.begin() + static_cast<std::ptrdiff_t>(second.size())));
    EXPECT_EQ(draw(other, field, size, mean, Reads::tiles, {4}).images, second);
}

TEST(Convolution, SingularNoiseHasARoot) {
    LinearField field = test::random_field(support(1), 3, 1.0);
    field.noise_covariance.assign(9, 2.0);
    const Eigen::MatrixXd root = noise_root(field);
    // Rounding of Σ's 9 entries: eigenvalues and with them Σ to some 10 units in the last place.
    EXPECT_LE((root * root.transpose()).eval().cwiseAbs().maxCoeff() - 2.0, 1e-14);
    EXPECT_LE(((root * root.transpose()).array() - 2.0).abs().maxCoeff(), 1e-14);
    EXPECT_EQ(root(0, 1), 0.0);
    field.noise_covariance = {1, 0, 0, 0, -1, 0, 0, 0, 1};
    EXPECT_THROW(static_cast<void>(noise_root(field)), InputError);
}

}  // namespace
}  // namespace btfield
