#include "host/btf/seen_planes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "host/btf/spread_pixels.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;

/// The lattice: rings, of which the first is the view from above, and views of a ring.
constexpr int rings = 6, around = 12;
/// Pixels that tell moments and shapes.
constexpr std::size_t seen_pixels = 4096;

/// Between the four pixels around a place; the surface is a torus.
class Place {
  public:
    Place(float x, float y, Size size) {
        const double left = std::floor(static_cast<double>(x)), top = std::floor(static_cast<double>(y));
        across_ = static_cast<double>(x) - left;
        down_ = static_cast<double>(y) - top;
        const auto around_n = [](double i, int n) { return (static_cast<int>(i) % n + n) % n; };
        const int column = around_n(left, size.width), right = around_n(left + 1.0, size.width);
        const int row = around_n(top, size.height), below = around_n(top + 1.0, size.height);
        const auto at = [&](int r, int c) {
            return static_cast<std::size_t>(r) * static_cast<std::size_t>(size.width) +
                   static_cast<std::size_t>(c);
        };
        corners_ = {at(row, column), at(row, right), at(below, column), at(below, right)};
    }
    [[nodiscard]] double of(std::span<const float> plane) const {
        const auto value = [&](std::size_t i) { return static_cast<double>(plane[corners_[i]]); };
        const double upper = value(0) + across_ * (value(1) - value(0));
        const double lower = value(2) + across_ * (value(3) - value(2));
        return upper + down_ * (lower - upper);
    }

  private:
    std::array<std::size_t, 4> corners_{};
    double across_ = 0.0, down_ = 0.0;
};

}  // namespace

SeenPlanes::SeenPlanes(DeviceImpl& device, const Image& surface, double steepest)
    : steepest_(steepest), planes_(static_cast<std::size_t>(surface.planes() - 1)) {
    Image height(surface.size(), 1);
    std::ranges::copy(surface.plane(0), height.values().begin());
    const RelievedSurface relief(device, height);
    for (int ring = 0; ring < rings; ++ring)
        for (int k = 0; k < around; ++k) {
            if (ring == 0 && k > 0)
                views_.push_back(views_.front());
            else
                views_.push_back(seen(relief, surface,
                                      {steepest * ring / (rings - 1), 2.0 * std::numbers::pi * k / around}));
        }
    for (const std::size_t pixel : spread_pixels(area(surface.size()), seen_pixels))
        for (std::size_t k = 0; k < planes_; ++k)
            sample_.push_back(surface.plane(static_cast<int>(k) + 1)[pixel]);
}

SeenPlanes::Moments SeenPlanes::seen(const RelievedSurface& relief, const Image& surface,
                                     const BtfDirection& view) const {
    const Size size = surface.size();
    const int rows = std::max(1, static_cast<int>(seen_pixels / static_cast<std::size_t>(size.width)));
    const ViewRays rays = relief.rays(view.vector(), std::max(1, size.height / rows));
    const auto m = static_cast<Index>(planes_);
    Moments moments{Eigen::VectorXd::Zero(m), Eigen::MatrixXd::Zero(m, m)};
    Eigen::VectorXd values(m);
    for (std::size_t p = 0; p < rays.columns.size(); ++p) {
        const Place place(rays.columns[p], rays.rows[p], size);
        for (Index k = 0; k < m; ++k) values[k] = place.of(surface.plane(static_cast<int>(k) + 1));
        moments.mean += values;
        moments.square.selfadjointView<Eigen::Lower>().rankUpdate(values);
    }
    const double share = 1.0 / static_cast<double>(rays.columns.size());
    moments.mean *= share;
    const Eigen::MatrixXd whole = moments.square.selfadjointView<Eigen::Lower>();
    moments.square = share * whole;
    return moments;
}

PlaneTone SeenPlanes::tone(const BtfDirection& view, std::span<const double> weights, double contrast) const {
    const Eigen::Map<const Eigen::VectorXd> u(weights.data(), static_cast<Index>(weights.size()));
    const double out = steepest_ > 0.0 ? (rings - 1) * std::min(view.theta / steepest_, 1.0) : 0.0;
    const double turn = view.phi / (2.0 * std::numbers::pi), along = around * (turn - std::floor(turn));
    const int ring = std::min(static_cast<int>(out), rings - 2),
              k = std::min(static_cast<int>(along), around - 1);
    double mean = 0.0, square = 0.0;
    for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2; ++j) {
            const double share =
                (i == 0 ? 1.0 - (out - ring) : out - ring) * (j == 0 ? 1.0 - (along - k) : along - k);
            const int place = (ring + i) * around + (k + j) % around;
            const Moments& of = views_[static_cast<std::size_t>(place)];
            mean += share * u.dot(of.mean);
            square += share * u.dot(of.square * u);
        }
    std::vector<float> sums(sample_.size() / planes_);
    for (std::size_t p = 0; p < sums.size(); ++p) {
        double sum = 0.0;
        for (std::size_t i = 0; i < planes_; ++i)
            sum += weights[i] * static_cast<double>(sample_[p * planes_ + i]);
        sums[p] = static_cast<float>(sum);
    }
    return PlaneDistribution(sums).tone(contrast, mean, std::sqrt(std::max(square - mean * mean, 0.0)));
}

}  // namespace btfield::detail
