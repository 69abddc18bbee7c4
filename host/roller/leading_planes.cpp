#include "host/roller/leading_planes.hpp"

#include <algorithm>

#include "host/base/eigen.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// Σ of products of planes over some of the rows: which axes are taken decides about time alone.
Eigen::MatrixXd moments_of(const Features& features) {
    const int step = std::max(1, features.size.height / 128);
    const auto d = static_cast<size_t>(features.planes);
    std::vector<std::int64_t> sums(d * d, 0);
    for (int r = 0; r < features.size.height; r += step)
        for (int c = 0; c < features.size.width; ++c) {
            const std::int16_t* pixel = features.at(r, c);
            for (size_t p = 0; p < d; ++p)
                for (size_t q = 0; q <= p; ++q) sums[p * d + q] += std::int64_t{pixel[p]} * pixel[q];
        }
    Eigen::MatrixXd moments(features.planes, features.planes);
    for (int p = 0; p < features.planes; ++p)
        for (int q = 0; q <= p; ++q)
            moments(p, q) = moments(q, p) =
                static_cast<double>(sums[static_cast<size_t>(p) * d + static_cast<size_t>(q)]);
    return moments;
}

}  // namespace

LeadingPlanes::LeadingPlanes(const Features& features, double share)
    : features_(&features), kept_(features.planes) {
    // Of more, axes take longer to find than planes to correlate.
    constexpr int most_planes = 64;
    if (features.planes > most_planes) return;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(moments_of(features));
    for (Eigen::Index a = features.planes - 1; a >= 0; --a)
        for (Eigen::Index p = 0; p < features.planes; ++p) axes_.push_back(solver.eigenvectors()(p, a));
    const double most = share * solver.eigenvalues().sum();
    for (double left = 0.0; kept_ > 1; --kept_) {
        left += solver.eigenvalues()(features.planes - kept_);
        if (left > most) break;
    }
}

void LeadingPlanes::keep_one_more() {
    kept_ = std::min(kept_ + 1, features_->planes);
}

double LeadingPlanes::turn(const std::int16_t* pixel, float* to, size_t stride) const {
    const auto d = static_cast<size_t>(features_->planes);
    if (all()) {  // integers are what they are in float32
        for (size_t p = 0; p < d; ++p) to[p * stride] = static_cast<float>(pixel[p]);
        return 0.0;
    }
    double left = 0.0;
    for (size_t p = 0; p < d; ++p) left += static_cast<double>(pixel[p]) * static_cast<double>(pixel[p]);
    const double* axis = axes_.data();
    for (size_t a = 0; a < static_cast<size_t>(kept_); ++a) {
        double value = 0.0;
        for (size_t p = 0; p < d; ++p) value += *axis++ * static_cast<double>(pixel[p]);
        to[a * stride] = static_cast<float>(value);
        left -= value * value;
    }
    return std::max(0.0, left);
}

}  // namespace btfield::detail
