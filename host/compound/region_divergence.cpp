#include "host/compound/region_divergence.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/base/eigen.hpp"
#include "host/base/parallel.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

constexpr size_t moment_pixels = 16384;
/// Of the picture's mean variance, added to all variances: a region may be of one colour.
constexpr double least_variance = 1e-4;

/// Sums over the pixels of each region.
struct RegionMoments {
    RegionMoments(int regions, int planes)
        : counts(static_cast<size_t>(regions)),
          sums(Eigen::MatrixXd::Zero(planes, regions)),
          products(static_cast<size_t>(regions), Eigen::MatrixXd::Zero(planes, planes)) {}
    RegionMoments& operator+=(const RegionMoments& other) {
        sums += other.sums;
        for (size_t k = 0; k < counts.size(); ++k) {
            counts[k] += other.counts[k];
            products[k] += other.products[k];
        }
        return *this;
    }
    std::vector<size_t> counts;
    Eigen::MatrixXd sums;                   ///< a column for each region
    std::vector<Eigen::MatrixXd> products;  ///< lower triangles
};

/// \param origin  a value near those of the planes, so that nothing cancels
RegionMoments block_moments(const PixelPlanes& planes, std::span<const std::uint8_t> labels, int regions,
                            const Eigen::VectorXd& origin, size_t first, size_t end) {
    RegionMoments moments(regions, planes.planes);
    const auto d = static_cast<size_t>(planes.planes);
    std::vector<double> x(d);
    for (size_t i = first; i < end; ++i) {
        for (size_t p = 0; p < d; ++p)
            x[p] = static_cast<double>(planes.values[p * planes.pixels + i]) - origin.data()[p];
        double* sum = moments.sums.data() + labels[i] * d;
        double* products = moments.products[labels[i]].data();
        ++moments.counts[labels[i]];
        for (size_t p = 0; p < d; ++p) {
            sum[p] += x[p];
            for (size_t q = p; q < d; ++q) products[p * d + q] += x[p] * x[q];
        }
    }
    return moments;
}

RegionMoments moments_of(const PixelPlanes& planes, std::span<const std::uint8_t> labels, int regions) {
    Eigen::VectorXd origin(planes.planes);
    for (int p = 0; p < planes.planes; ++p) origin[p] = static_cast<double>(planes.plane(p)[0]);
    const size_t blocks = (planes.pixels + moment_pixels - 1) / moment_pixels;
    std::vector<RegionMoments> parts(blocks, RegionMoments(0, 0));
    for_each_block(static_cast<int>(blocks), [&](int block) {
        const size_t first = static_cast<size_t>(block) * moment_pixels;
        parts[static_cast<size_t>(block)] = block_moments(planes, labels, regions, origin, first,
                                                          std::min(planes.pixels, first + moment_pixels));
    });
    for (size_t b = 1; b < blocks; ++b) parts.front() += parts[b];
    return parts.front();
}

struct RegionNormal {
    Eigen::VectorXd mean;
    Eigen::MatrixXd covariance, inverse;
};

std::vector<RegionNormal> normals_of(const RegionMoments& moments) {
    const Eigen::Index d = moments.sums.rows();
    const Eigen::VectorXd sum = moments.sums.rowwise().sum();
    double count = 0.0, trace = 0.0;
    for (size_t k = 0; k < moments.counts.size(); ++k) {
        count += static_cast<double>(moments.counts[k]);
        trace += moments.products[k].trace();
    }
    const double variance = (trace - sum.squaredNorm() / count) / count / static_cast<double>(d);
    std::vector<RegionNormal> normals(moments.counts.size());
    for (size_t k = 0; k < normals.size(); ++k) {
        RegionNormal& normal = normals[k];
        const auto pixels = static_cast<double>(moments.counts[k]);
        normal.mean = moments.sums.col(static_cast<Eigen::Index>(k)) / pixels;
        normal.covariance = moments.products[k].selfadjointView<Eigen::Lower>();
        normal.covariance = normal.covariance / pixels - normal.mean * normal.mean.transpose();
        normal.covariance.diagonal().array() += least_variance * variance;
        const Eigen::LLT<Eigen::MatrixXd> factor(normal.covariance);
        normal.inverse = factor.solve(Eigen::MatrixXd::Identity(d, d));
    }
    return normals;
}

double divergence_of(const RegionNormal& a, const RegionNormal& b) {
    const Eigen::VectorXd apart = a.mean - b.mean;
    return 0.25 * (a.inverse.cwiseProduct(b.covariance).sum() + b.inverse.cwiseProduct(a.covariance).sum() -
                   2.0 * static_cast<double>(apart.size()) + apart.dot((a.inverse + b.inverse) * apart));
}

}  // namespace

RegionDistances region_distances(const PixelPlanes& planes, std::span<const std::uint8_t> labels,
                                 int regions) {
    const RegionMoments moments = moments_of(planes, labels, regions);
    RegionDistances distances{*std::ranges::min_element(moments.counts), 0.0};
    if (distances.fewest_pixels == 0) return distances;
    const std::vector<RegionNormal> normals = normals_of(moments);
    distances.least = std::numeric_limits<double>::infinity();
    for (size_t a = 0; a < normals.size(); ++a)
        for (size_t b = 0; b < a; ++b)
            distances.least = std::min(distances.least, divergence_of(normals[a], normals[b]));
    if (!std::isfinite(distances.least)) distances.least = 0.0;
    return distances;
}

}  // namespace btfield::detail
