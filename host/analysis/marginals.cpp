#include "btfield/marginals.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "btfield/error.hpp"
#include "host/analysis/marginal_moments.hpp"
#include "host/analysis/ranking.hpp"
#include "host/base/eigen.hpp"
#include "host/base/non_negative.hpp"
#include "host/base/normal_distribution.hpp"
#include "host/base/parallel.hpp"
#include "host/base/stop.hpp"
#include "host/base/work_part.hpp"

namespace btfield {

using namespace detail;

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::size_t;

/// Cells that an interval between knots is cut into to average the quantile function.
constexpr int cells = 32;

void require_knots(const std::string& asked, size_t knots) {
    if (knots >= fewest_knots && knots <= most_knots) return;
    throw InputError(asked, "there are " + std::to_string(knots) + " knots",
                     "use " + std::to_string(fewest_knots) + " to " + std::to_string(most_knots));
}

/// Φ⁻¹((k + 1/2)/N) for the k of the lower half, all divided by their deviation, and 0 in the middle of an
/// odd N. The upper half mirrors it: the mean is 0.
std::vector<float> normal_scores(size_t count) {
    constexpr size_t block_size = 1 << 14;
    const size_t half = count / 2;
    const size_t blocks = (half + block_size - 1) / block_size;
    std::vector<double> lower(half), squares(blocks);
    for_each_block(static_cast<int>(blocks), [&](int block) {
        const size_t first = static_cast<size_t>(block) * block_size;
        double sum = 0.0;
        for (size_t k = first; k < std::min(first + block_size, half); ++k) {
            lower[k] = normal_quantile((static_cast<double>(k) + 0.5) / static_cast<double>(count));
            sum += lower[k] * lower[k];
        }
        squares[static_cast<size_t>(block)] = sum;
    });
    double sum = 0.0;
    for (const double square : squares) sum += square;
    const double scale = std::sqrt(static_cast<double>(count) / (2.0 * sum));
    std::vector<float> scores(count);
    for (size_t k = 0; k < half; ++k) {
        scores[k] = static_cast<float>(scale * lower[k]);
        scores[count - 1 - k] = -scores[k];
    }
    return scores;
}

/// Partial sums of the sorted values: ∫₀^u of the empirical quantile function, for growing u.
class QuantileIntegral {
  public:
    explicit QuantileIntegral(const std::vector<RankedPixel>& pixels) : pixels_(&pixels) {}
    double to(double u) {
        const auto count = static_cast<double>(pixels_->size());
        const double place = std::min(u, 1.0) * count;
        while (static_cast<double>(next_ + 1) <= place && next_ < pixels_->size())
            sum_ += static_cast<double>(sorted_value((*pixels_)[next_++].key));
        double rest = 0.0;
        if (next_ < pixels_->size())
            rest = (place - static_cast<double>(next_)) *
                   static_cast<double>(sorted_value((*pixels_)[next_].key));
        return (sum_ + rest) / count;
    }

  private:
    const std::vector<RankedPixel>* pixels_;
    size_t next_ = 0;
    double sum_ = 0.0;
};

/// E h_k(x) Q(x), Q the empirical quantile function over the normal axis, averaged in each cell.
VectorXd projections(const std::vector<RankedPixel>& pixels, int knots) {
    VectorXd sums = VectorXd::Zero(knots);
    QuantileIntegral integral(pixels);
    const double step = knot(1, knots) - knot(0, knots);
    double before = integral.to(normal_cumulative(-marginal_reach));
    sums(0) = before;
    for (int k = 0; k + 1 < knots; ++k) {
        for (int c = 0; c < cells; ++c) {
            const double from = static_cast<double>(c) / cells, to = (c + 1.0) / cells;
            const double a = knot(k, knots) + from * step, b = knot(k, knots) + to * step;
            const double up_to = integral.to(normal_cumulative(b));
            const double mean = (up_to - before) / normal_probability(a, b);
            before = up_to;
            // ∫ h_{k+1} φ over the cell.
            const double up =
                (normal_density(a) - normal_density(b) - knot(k, knots) * normal_probability(a, b)) / step;
            sums(k + 1) += mean * up;
            sums(k) += mean * (normal_probability(a, b) - up);
        }
    }
    sums(knots - 1) += integral.to(1.0) - before;
    return sums;
}

/// min E (q(x) − Q(x))² over non-decreasing q, then moved and scaled to mean and variance. The unknowns are
/// the increments q_{k+1} − q_k >= 0; the constant drops out of the covariances of the hat functions.
Marginal fit_marginal(const VectorXd& projection, const HatMoments& hats, double mean, double variance) {
    const auto n = static_cast<Index>(hats.mean.size());
    const Eigen::Map<const VectorXd> w(hats.mean.data(), n);
    MatrixXd gram = -w * w.transpose();
    for (Index k = 0; k < n; ++k) {
        gram(k, k) += hats.square[static_cast<size_t>(k)];
        if (k + 1 < n) {
            gram(k, k + 1) += hats.product[static_cast<size_t>(k)];
            gram(k + 1, k) += hats.product[static_cast<size_t>(k)];
        }
    }
    // q_k = Σ_{m < k} δ_m: sums over all knots above.
    MatrixXd sums = MatrixXd::Zero(n, n - 1);
    for (Index k = 0; k < n; ++k) sums.row(k).head(k).setOnes();
    const Eigen::LLT<MatrixXd> factor(MatrixXd(sums.transpose() * gram * sums));
    const VectorXd right = factor.matrixL().solve(sums.transpose() * (projection - w * projection.sum()));
    const VectorXd increments = non_negative_least_squares(MatrixXd(factor.matrixU()), right);

    Marginal marginal;
    const VectorXd q = sums * increments;
    marginal.values.assign(q.data(), q.data() + n);
    const MappedMoments found = mapped_moments(marginal, hats);
    const double scale = std::sqrt(variance / found.variance);
    for (double& value : marginal.values) value = mean + scale * (value - found.mean);
    return marginal;
}

/// Mean and variance of sorted values; equal values of any number have variance 0.
MappedMoments moments_of(const std::vector<RankedPixel>& pixels) {
    const auto count = static_cast<double>(pixels.size());
    const double centre = static_cast<double>(sorted_value(pixels[pixels.size() / 2].key));
    double sum = 0.0, squares = 0.0;
    for (const RankedPixel& pixel : pixels) {
        const double c = static_cast<double>(sorted_value(pixel.key)) - centre;
        sum += c;
        squares += c * c;
    }
    return {centre + sum / count, std::max(0.0, squares / count - (sum / count) * (sum / count))};
}

}  // namespace

double quantile(const Marginal& marginal, double x) {
    const std::vector<double>& q = marginal.values;
    const auto last = static_cast<double>(q.size() - 1);
    const double u = std::clamp((x + marginal_reach) * last / (2.0 * marginal_reach), 0.0, last);
    if (std::isnan(u)) return u;
    const size_t k = std::min(static_cast<size_t>(u), q.size() - 2);
    return q[k] + (u - static_cast<double>(k)) * (q[k + 1] - q[k]);
}

GaussianPlanes gaussianise(const Image& planes, int knots) {
    const std::string asked = "map planes to normals";
    if (planes.planes() < 1 || area(planes.size()) == 0)
        throw InputError(asked, "there is no pixel", "give at least one");
    require_knots(asked, static_cast<size_t>(std::max(knots, 0)));

    const std::vector<float> scores = normal_scores(area(planes.size()));
    const HatMoments hats = hat_moments(knots, 1.0);
    GaussianPlanes result{Image(planes.size(), planes.planes(), planes.space()),
                          std::vector<Marginal>(static_cast<size_t>(planes.planes()))};
    for_each_part(planes.planes(), [&](int p) {
        const std::span<const float> values = planes.plane(p);
        const std::string which = "plane " + std::to_string(p);
        if (!std::ranges::all_of(values, [](float v) { return std::isfinite(v); }))
            throw InputError(asked, which + " holds values that are not finite",
                             "replace NaN and infinite pixels");
        const std::vector<RankedPixel> order = ascending(values, static_cast<std::uint32_t>(p));
        if (order.front().key == order.back().key)
            throw InputError(asked, which + " is constant", "leave it out");
        stop_if_asked();
        const std::span<float> out = result.planes.plane(p);
        for (size_t k = 0; k < order.size(); ++k) out[order[k].place] = scores[k];
        stop_if_asked();
        const MappedMoments moments = moments_of(order);
        result.marginals[static_cast<size_t>(p)] =
            fit_marginal(projections(order, knots), hats, moments.mean, moments.variance);
    });
    return result;
}

Image map_back(const Image& gaussian, std::span<const Marginal> marginals) {
    if (static_cast<size_t>(gaussian.planes()) != marginals.size())
        throw InputError("map " + std::to_string(gaussian.planes()) + " planes back",
                         "there are " + std::to_string(marginals.size()) + " marginals",
                         "give one to each plane");
    Image result(gaussian.size(), gaussian.planes(), gaussian.space());
    for_each_block(gaussian.planes(), [&](int p) {
        const Marginal& marginal = marginals[static_cast<size_t>(p)];
        std::ranges::transform(gaussian.plane(p), result.plane(p).begin(), [&](float x) {
            return static_cast<float>(quantile(marginal, static_cast<double>(x)));
        });
    });
    return result;
}

void check(const Marginal& marginal) {
    const std::string asked = "use a marginal";
    require_knots(asked, marginal.values.size());
    const std::vector<double>& q = marginal.values;
    if (!std::ranges::all_of(q, [](double value) { return std::isfinite(value); }))
        throw InputError(asked, "its values are not finite", "fit the model anew");
    if (!std::ranges::is_sorted(q)) throw InputError(asked, "its values decrease", "fit the model anew");
    if (!(q.front() < q.back())) throw InputError(asked, "it is constant", "fit the model anew");
}

}  // namespace btfield
