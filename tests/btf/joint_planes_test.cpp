// host/btf/view_rays.cpp, reduced_view.cpp, joint_planes.cpp and kernels/btf/view_rays.cl.

#include "host/btf/joint_planes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "btfield/btf_set.hpp"
#include "btfield/threads.hpp"
#include "tests/device_cases.hpp"
#include "tests/reference/made_btf.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;

constexpr Size size{20, 24};
constexpr int pixels = 20 * 24;

/// Hills about 0, of which some hide others.
Image hills(double high = 2.0) {
    Image height(size, 1);
    for (int r = 0; r < size.height; ++r)
        for (int c = 0; c < size.width; ++c)
            height.at(0, r, c) = static_cast<float>(
                high * std::sin(2.0 * std::numbers::pi * (2.0 * c / size.width + 1.0 * r / size.height)));
    return height;
}

RowMajorMatrix noise(int rows, int columns, unsigned seed) {
    std::mt19937 generator(seed);
    RowMajorMatrix result(rows, columns);
    for (Index i = 0; i < result.size(); ++i)
        result.data()[i] = static_cast<double>(generator() % 2001) / 1000.0 - 1.0;
    return result;
}

std::vector<BtfDirection> directions() {
    std::vector<BtfDirection> result{{}};
    for (const double theta : {0.6, 1.2})
        for (int k = 0; k < 5; ++k) result.push_back({theta, 2.0 * std::numbers::pi * k / 5.0 + theta});
    return result;
}

class JointPlanesSmall : public testing::Test {
  protected:
    Device device_ = test::device_of_width(1);
};

TEST_F(JointPlanesSmall, RaysMeetTheReliefWhereTheReferenceHasThem) {
    const Image height = hills();
    const RelievedSurface surface(device_.impl(), height);
    for (const BtfDirection& direction : directions()) {
        const ViewRays rays = surface.rays(direction.vector());
        double largest = 0.0;
        for (int r = 0; r < size.height; ++r)
            for (int c = 0; c < size.width; ++c) {
                const auto [x, y] = reference::seen_at(height, r, c, direction.vector());
                const auto p = static_cast<std::size_t>(r * size.width + c);
                const auto apart = [](double a, double b, double period) {
                    const double d = std::abs(a - b);
                    return std::abs(d - period * std::round(d / period));
                };
                largest = std::max({largest, apart(x, static_cast<double>(rays.columns[p]), size.width),
                                    apart(y, static_cast<double>(rays.rows[p]), size.height)});
            }
        EXPECT_LE(largest, 0.03) << direction.theta << " " << direction.phi;
    }
}

TEST_F(JointPlanesSmall, ScatteringIsTheAdjointOfGathering) {
    const RelievedSurface surface(device_.impl(), hills());
    const RowMajorMatrix planes = noise(pixels, 3, 1), picture = noise(pixels, 3, 2);
    for (const bool periodic : {true, false}) {
        const SurfaceGather gather(surface.rays(BtfDirection{1.1, 0.4}.vector()), periodic);
        EXPECT_EQ(gather.count() == static_cast<std::size_t>(pixels), periodic);
        RowMajorMatrix seen(pixels, 3), spread = RowMajorMatrix::Zero(pixels, 3);
        gather.gather(planes, 0, seen);
        gather.scatter(picture, 0, spread);
        EXPECT_NEAR(seen.cwiseProduct(picture).sum(), planes.cwiseProduct(spread).sum(), 1e-9);
    }
    const RelievedSurface level(device_.impl(), Image(size, 1));
    RowMajorMatrix seen(pixels, 3);
    SurfaceGather(level.rays(BtfDirection{0.9, 2.0}.vector()), true).gather(planes, 0, seen);
    EXPECT_LE((seen - planes).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(ReducedView, KeepsMeansAndWhatItsRankCanHold) {
    const RowMajorMatrix mix = noise(9, 4, 3), planes = noise(4, pixels, 4);
    RowMajorMatrix z = 0.1 * mix * planes;
    z.array() += 1.0;
    const auto read = [&](int picture, std::span<float> to) {
        for (int c = 0; c < 3; ++c)
            for (int p = 0; p < pixels; ++p)
                to[static_cast<std::size_t>(c * pixels + p)] =
                    static_cast<float>(0.3 * (picture + 1) * z(3 * picture + c, p) * z(3 * picture + c, p));
    };
    const ReducedView view = reduce_view(3, 3, pixels, 6, read);
    ASSERT_EQ(view.mean.size(), 9U);
    RowMajorMatrix b(pixels, static_cast<Index>(view.rank()));
    view.take(0, b);
    const RowMajorMatrix back = view.basis * b.transpose();
    double worst = 0.0;
    for (Index row = 0; row < 9; ++row) {
        const double mean = 0.3 * static_cast<double>(row / 3 + 1) * z.row(row).squaredNorm() / pixels;
        EXPECT_NEAR(view.mean[static_cast<std::size_t>(row)], mean, 1e-5 * mean);
        const Eigen::RowVectorXd relative = z.row(row) / std::sqrt(z.row(row).squaredNorm() / pixels);
        EXPECT_NEAR(view.offset[static_cast<std::size_t>(row)], relative.mean(), 1e-5);
        worst =
            std::max(worst, (relative.array() - relative.mean() - back.row(row).array()).abs().maxCoeff());
    }
    EXPECT_LE(worst, 1e-4);
    EXPECT_LE(view.lost, 1e-6 * view.energy);
    const ReducedView two = reduce_view(3, 3, pixels, 2, read);
    EXPECT_EQ(two.rank(), 2U);
    EXPECT_GT(two.lost, 0.01 * two.energy);
}

TEST(ReducedView, BlackPicturesAreNothing) {
    const ReducedView view =
        reduce_view(2, 1, pixels, 4, [](int, std::span<float> to) { std::ranges::fill(to, 0.0F); });
    EXPECT_EQ(view.rank(), 0U);
    EXPECT_EQ(view.mean, std::vector<double>(2, 0.0));
    EXPECT_EQ(view.energy, 0.0);
}

/// Pictures that really are made of three planes of a surface with relief.
class KnownSurface {
  public:
    KnownSurface(Device& device, const Image& height) : surface_(device.impl(), height) {
        planes_ = noise(pixels, 3, 7);
        for (const BtfDirection& direction : directions()) {
            if (direction.theta == 0.0) continue;  // no view has the planes as they are
            const SurfaceGather gather(surface_.rays(direction.vector()), true);
            RowMajorMatrix seen(pixels, 3);
            gather.gather(planes_, 0, seen);
            const RowMajorMatrix weights = 0.15 * noise(8, 3, static_cast<unsigned>(10 + views_.size()));
            RowMajorMatrix z = weights * seen.transpose();
            z.array() += 1.0;
            JointView view;
            view.index = static_cast<int>(views_.size());
            view.direction = direction.vector();
            view.reduced = reduce_view(8, 1, pixels, 12, [&](int picture, std::span<float> to) {
                for (int p = 0; p < pixels; ++p)
                    to[static_cast<std::size_t>(p)] = static_cast<float>(z(picture, p) * z(picture, p));
            });
            views_.push_back(std::move(view));
        }
    }
    [[nodiscard]] JointPlanes fit(const RelievedSurface& surface, int planes, int passes) const {
        JointOptions options;
        options.planes = planes;
        options.periodic = true;
        options.passes = passes;
        return fit_joint_planes(surface, views_, options);
    }
    RelievedSurface surface_;
    RowMajorMatrix planes_;
    std::vector<JointView> views_;
};

TEST_F(JointPlanesSmall, PlanesThatPicturesAreMadeOfAreFound) {
    const KnownSurface known(device_, hills());
    const JointPlanes found = known.fit(known.surface_, 3, 6);
    EXPECT_LE(found.unexplained, 2e-3);
    EXPECT_LE(found.unexplained, 0.2 * known.fit(known.surface_, 3, 0).unexplained);
    // Their span is that of the true planes: whatever is left of these is small.
    RowMajorMatrix truth = known.planes_;
    truth.rowwise() -= Eigen::RowVectorXd(truth.colwise().mean());
    const RowMajorMatrix inside = found.planes.transpose() * truth / pixels;
    EXPECT_LE((truth - found.planes * inside).squaredNorm(), 0.02 * truth.squaredNorm());
    // Conventions: mean 0, covariance 1, what explains most first.
    const Eigen::MatrixXd covariance = found.planes.transpose() * found.planes / pixels;
    EXPECT_LE((covariance - Eigen::MatrixXd::Identity(3, 3)).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_LE(found.planes.colwise().mean().cwiseAbs().maxCoeff(), 1e-9);
    Eigen::MatrixXd energy = Eigen::MatrixXd::Zero(3, 3);
    for (const RowMajorMatrix& u : found.weights) energy += u.transpose() * u;
    EXPECT_GE(energy(0, 0), energy(1, 1));
    EXPECT_GE(energy(1, 1), energy(2, 2));
    EXPECT_LE(std::abs(energy(0, 1)), 1e-6 * energy(0, 0));
}

TEST_F(JointPlanesSmall, TheWrongReliefExplainsLess) {
    const KnownSurface known(device_, hills());
    const double right = known.fit(known.surface_, 3, 3).unexplained;
    for (const double factor : {0.0, 0.7, 1.4}) {
        const RelievedSurface wrong(device_.impl(), hills(2.0 * factor));
        EXPECT_GT(known.fit(wrong, 3, 3).unexplained, 3.0 * right) << factor;
    }
}

TEST_F(JointPlanesSmall, ThreadsDoNotMatter) {
    const KnownSurface known(device_, hills());
    limit_threads(1);
    const JointPlanes one = known.fit(known.surface_, 3, 2);
    limit_threads(3);
    const JointPlanes three = known.fit(known.surface_, 3, 2);
    limit_threads(0);
    EXPECT_EQ(one.unexplained, three.unexplained);
    EXPECT_EQ((one.planes - three.planes).cwiseAbs().maxCoeff(), 0.0);
}

}  // namespace
}  // namespace btfield::detail
