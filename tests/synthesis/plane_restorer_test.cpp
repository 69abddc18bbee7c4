#include "host/synthesis/plane_restorer.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <utility>

#include "btfield/error.hpp"
#include "tests/device_cases.hpp"
#include "tests/reference/algebra.hpp"
#include "tests/reference/plane_restorer.hpp"

namespace btfield {

using namespace detail;

namespace {

/// Rows of a random orthogonal matrix, and a mean.
SpectralBasis random_basis(int rank, int planes) {
    std::mt19937 generator(static_cast<unsigned>(100 * rank + planes));
    std::normal_distribution<double> normal;
    Eigen::MatrixXd values(planes, planes);
    for (Eigen::Index k = 0; k < values.size(); ++k) values(k) = normal(generator);
    const Eigen::MatrixXd q = reference::orthogonal_factor(values);
    SpectralBasis basis;
    basis.planes = planes;
    basis.rank = rank;
    for (int j = 0; j < rank; ++j)
        for (int i = 0; i < planes; ++i) basis.matrix.push_back(q(i, j));
    for (int i = 0; i < planes; ++i) basis.mean.push_back(normal(generator));
    return basis;
}

/// Increments from 0 to 1, some of them 0.
std::vector<Marginal> random_marginals(int count, int knots) {
    std::mt19937 generator(static_cast<unsigned>(knots));
    std::uniform_real_distribution<double> uniform;
    std::vector<Marginal> marginals(static_cast<std::size_t>(count));
    for (Marginal& marginal : marginals) {
        double q = -0.25 * knots;
        for (int k = 0; k < knots; ++k) {
            marginal.values.push_back(q);
            q += k % 5 == 3 ? 0.0 : uniform(generator);
        }
    }
    return marginals;
}

/// Normals, and among them what lies at and beyond the ends.
Image gaussian_planes(Size size, int planes) {
    Image image = test::random_image(size, planes, 0.0F, 5);
    const float special[] = {3.5F, -3.5F, 3.4999F, -3.4999F, 4.0F, -4.0F, 1e9F, -1e9F, 0.0F};
    std::size_t at = 0;
    for (const float value : special) {
        at = (at + 7) % image.values().size();
        image.values()[at] = value;
    }
    return image;
}

DevicePlanes upload(Device& device, const Image& image) {
    return {device.impl().upload(std::as_const(image).values()), image.size(), image.size(), image.planes()};
}

Image download(Device& device, const DevicePlanes& planes) {
    Image image(planes.lattice, planes.planes);
    device.impl().read(planes.values, image.values().data(), image.values().size_bytes());
    return image;
}

/// Against float64. Rounding: u of a normal x among n knots is off by 2 roundings of at most n, which the
/// slope (at most 1 a knot here) carries over; q_k and its step are rounded once, as are T and μ; then r + 1
/// sums.
void check_restored(Device& device, const SpectralBasis& basis, const std::vector<Marginal>& marginals,
                    Size size, int textures) {
    SCOPED_TRACE(test::text(size) + ", r = " + std::to_string(basis.rank) +
                 ", d = " + std::to_string(basis.planes) + ", " +
                 std::to_string(marginals.empty() ? 0 : marginals.front().values.size()) + " knots");
    const Image source = gaussian_planes(size, basis.rank * textures);
    PlaneRestorer restorer(device.impl(), basis, marginals);
    DevicePlanes given = upload(device, source);
    const DevicePlanes restored = restorer.restore(std::move(given));
    ASSERT_EQ(restored.planes, basis.planes * textures);
    ASSERT_EQ(restored.size, size);
    const Image found = download(device, restored);

    const auto r = static_cast<std::size_t>(basis.rank);
    const double knots = marginals.empty() ? 0.0 : static_cast<double>(marginals.front().values.size());
    for (int t = 0; t < textures; ++t)
        for (std::size_t at = 0; at < area(size); ++at) {
            std::vector<double> m;
            double bound = 0.0;
            for (std::size_t j = 0; j < r; ++j) {
                const auto x = static_cast<double>(source.plane(t * basis.rank + static_cast<int>(j))[at]);
                m.push_back(marginals.empty() ? x : reference::mapped(marginals[j].values, x));
                bound += (3.0 + knots) * knots + 3.0 * std::abs(m.back());
            }
            const std::vector<double> expected = reference::restored(basis.matrix, basis.mean, m);
            for (std::size_t i = 0; i < expected.size(); ++i) {
                const double off =
                    std::abs(static_cast<double>(found.plane(t * basis.planes + static_cast<int>(i))[at]) -
                             expected[i]);
                double largest = std::abs(basis.mean[i]);
                for (const double value : m) largest += std::abs(value);
                ASSERT_LE(off, test::unit_roundoff * (bound + (static_cast<double>(r) + 2.0) * largest))
                    << "texture " << t << ", plane " << i << ", pixel " << at;
            }
        }
}

class PlaneRestorerSmall : public testing::TestWithParam<int> {
  protected:
    Device device_ = test::device_of_width(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Widths, PlaneRestorerSmall, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(PlaneRestorerSmall, FollowTheReference) {
    for (const auto& [rank, planes] : {std::pair{1, 1}, std::pair{1, 3}, std::pair{3, 3}, std::pair{4, 6}})
        for (const Size size : {Size{1, 1}, Size{17, 31}})
            check_restored(device_, random_basis(rank, planes), random_marginals(rank, 24), size, 2);
}

TEST_P(PlaneRestorerSmall, TurnsAlone) {
    for (const auto& [rank, planes] : {std::pair{2, 3}, std::pair{3, 3}})
        check_restored(device_, random_basis(rank, planes), {}, {13, 11}, 2);
}

class PlaneRestorerSizes : public testing::TestWithParam<int> {
  protected:
    Device device_ = test::device_of_width(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Widths, PlaneRestorerSizes, testing::ValuesIn(test::vector_widths),
                         testing::PrintToStringParamName());

TEST_P(PlaneRestorerSizes, EverySize) {
    for (const Size size : test::lattice_sizes)
        check_restored(device_, random_basis(3, 3), random_marginals(3, 24), size, 3);
}

TEST_P(PlaneRestorerSizes, EveryRankAndNumberOfKnots) {
    for (const auto& [rank, planes] : {std::pair{4, 4}, std::pair{7, 8}, std::pair{5, 12}})
        check_restored(device_, random_basis(rank, planes), random_marginals(rank, 16), {19, 23}, 1);
    for (const int knots : {fewest_knots, most_knots})
        check_restored(device_, random_basis(2, 2), random_marginals(2, knots), {19, 23}, 1);
}

TEST_P(PlaneRestorerSizes, NothingBeyondTheLastPixelIsTouched) {
    // A buffer as long as the planes and one vector more.
    const Size size{7, 9};
    const SpectralBasis basis = random_basis(3, 3);
    std::vector<float> values(3 * area(size) + 16, 0.25F);
    PlaneRestorer restorer(device_.impl(), basis, random_marginals(3, 24));
    const DevicePlanes restored = restorer.restore({device_.impl().upload(values), size, size, 3});
    const std::vector<float> found = test::read_all<float>(device_, restored.values);
    for (std::size_t k = 3 * area(size); k < found.size(); ++k) EXPECT_EQ(found[k], 0.25F);
}

TEST_P(PlaneRestorerSizes, NaNStaysNaN) {
    Image image = test::random_image({5, 7}, 3);
    image.at(1, 2, 3) = std::numeric_limits<float>::quiet_NaN();
    const SpectralBasis basis = random_basis(3, 3);
    PlaneRestorer restorer(device_.impl(), basis, random_marginals(3, 24));
    const Image found = download(device_, restorer.restore(upload(device_, image)));
    for (int row = 0; row < 5; ++row)
        for (int column = 0; column < 7; ++column)
            for (int p = 0; p < 3; ++p)
                EXPECT_EQ(std::isnan(found.at(p, row, column)), row == 2 && column == 3);
}

TEST(PlaneRestorerWidths, Agree) {
    const Size size{37, 41};
    const Image source = gaussian_planes(size, 6);
    Image first;
    for (const int width : test::vector_widths) {
        Device device = test::device_of_width(width);
        PlaneRestorer restorer(device.impl(), random_basis(3, 4), random_marginals(3, 24));
        const Image found = download(device, restorer.restore(upload(device, source)));
        if (first.planes() == 0) first = found;
        // Values up to 6 in magnitude of three planes; 16 lanes add up the 23 steps one by one, others look
        // them up.
        for (std::size_t k = 0; k < found.values().size(); ++k)
            ASSERT_LE(std::abs(found.values()[k] - first.values()[k]),
                      2 * 3 * (3 * 24 + 24 * 6) * test::unit_roundoff)
                << "width " << width;
    }
}

TEST(PlaneRestorerWidths, TheHostMapsAlike) {
    const Image source = gaussian_planes({31, 17}, 3);
    const SpectralBasis basis = random_basis(3, 3);
    const std::vector<Marginal> marginals = random_marginals(3, 24);
    Device device;
    PlaneRestorer restorer(device.impl(), basis, marginals);
    const Image here = from_eigenplanes(basis, map_back(source, marginals), ColourSpace::unspecified);
    const Image there = download(device, restorer.restore(upload(device, source)));
    // As in check_restored: values up to 6 in magnitude, 24 knots, three planes.
    for (std::size_t k = 0; k < here.values().size(); ++k)
        ASSERT_LE(std::abs(here.values()[k] - there.values()[k]),
                  3 * (3 * 24 + 24 * 6) * test::unit_roundoff);
}

TEST(PlaneRestorerWidths, RefuseWhatDoesNotBelongTogether) {
    Device device;
    DeviceImpl& impl = device.impl();
    const SpectralBasis basis = random_basis(2, 3);
    EXPECT_THROW(PlaneRestorer(impl, basis, random_marginals(3, 16)), InputError);
    std::vector<Marginal> marginals = random_marginals(2, 16);
    marginals[1] = random_marginals(1, 17)[0];
    EXPECT_THROW(PlaneRestorer(impl, basis, marginals), InputError);
    marginals[1].values.assign(16, 0.0);
    EXPECT_THROW(PlaneRestorer(impl, basis, marginals), InputError);
    SpectralBasis defective = basis;
    defective.mean.pop_back();
    EXPECT_THROW(PlaneRestorer(impl, defective, random_marginals(2, 16)), InputError);
    PlaneRestorer restorer(impl, basis, random_marginals(2, 16));
    EXPECT_EQ(restorer.scratch_bytes({5, 7}, 2), 2U * 3U * 35U * sizeof(float));
    EXPECT_EQ(PlaneRestorer(impl, random_basis(3, 3), {}).scratch_bytes({5, 7}, 2), 0U);
}

}  // namespace
}  // namespace btfield
