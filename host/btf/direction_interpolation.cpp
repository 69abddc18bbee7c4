#include "host/btf/direction_interpolation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/eigen.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t plate_neighbours = 80;
/// Of squared distances: directions that are the same but for rounding.
constexpr double same_place = 1e-12;
/// Lights count by the tangent of their angle, which is that of 75 degrees at 1.
const double tangent_unit = std::tan(75.0 * std::numbers::pi / 180.0);

double squared_distance(const DirectionPoint& a, const DirectionPoint& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
    return sum;
}

/// r² log r of a squared distance.
double plate(double squared) {
    return squared > 0.0 ? 0.5 * squared * std::log(squared) : 0.0;
}

/// Weights of values at `points` for the value at the origin: interpolation by thin plates and a linear
/// function, of which directions that points do not differ in are left out.
VectorXd plate_weights(const MatrixXd& points) {
    const Index n = points.rows(), dimensions = points.cols();
    const Eigen::RowVectorXd mean = points.colwise().mean();
    const MatrixXd centred = points.rowwise() - mean;
    const MatrixXd moments = centred.transpose() * centred;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(moments);
    Index kept = 0;
    while (kept < dimensions && kept + 1 < n &&
           solver.eigenvalues()[dimensions - 1 - kept] > 1e-6 * solver.eigenvalues()[dimensions - 1])
        ++kept;
    const MatrixXd axes = solver.eigenvectors().rightCols(kept);
    MatrixXd system = MatrixXd::Zero(n + 1 + kept, n + 1 + kept);
    VectorXd right = VectorXd::Zero(n + 1 + kept);
    for (Index i = 0; i < n; ++i) {
        for (Index j = 0; j < n; ++j) system(i, j) = plate((points.row(i) - points.row(j)).squaredNorm());
        right[i] = plate(points.row(i).squaredNorm());
    }
    const MatrixXd linear = centred * axes;
    system.block(0, n, n, 1).setOnes();
    system.block(0, n + 1, n, kept) = linear;
    system.block(n, 0, 1 + kept, n) = system.block(0, n, n, 1 + kept).transpose();
    right[n] = 1.0;
    right.tail(kept) = -(mean * axes).transpose();
    const Eigen::PartialPivLU<MatrixXd> factor(system);
    const VectorXd solved = factor.solve(right);
    return solved.head(n);
}

}  // namespace

DirectionTable::DirectionTable(const BtfModel& model) : model_(&model) {
    for (const BtfPair& pair : model.pairs)
        steepest_view_ = std::max(steepest_view_, model.views[static_cast<std::size_t>(pair.view)].theta);
    for (std::size_t i = 0; i < model.pairs.size(); ++i)
        steepest_light_ = std::max(steepest_light_, light_of(i).theta);
    for (std::size_t i = 0; i < model.pairs.size(); ++i)
        points_.push_back(point(model.views[static_cast<std::size_t>(model.pairs[i].view)], light_of(i)));
}

BtfDirection DirectionTable::view_of(std::size_t pair) const {
    return model_->views[static_cast<std::size_t>(model_->pairs[pair].view)];
}

BtfDirection DirectionTable::light_of(std::size_t pair) const {
    if (!model_->true_lights.empty()) return model_->true_lights[pair];
    return model_->lights[static_cast<std::size_t>(model_->pairs[pair].light)];
}

DirectionPoint DirectionTable::point(const BtfDirection& view, const BtfDirection& light) const {
    const auto v = view.vector(), l = light.vector();
    const double tangent = std::tan(light.theta) / tangent_unit, upward = v[2] + l[2];
    return {view.theta * std::cos(view.phi), view.theta * std::sin(view.phi), tangent * std::cos(light.phi),
            tangent * std::sin(light.phi),   2.0 * (v[0] + l[0]) / upward,    2.0 * (v[1] + l[1]) / upward};
}

std::vector<TableWeight> DirectionTable::nearest(const BtfDirection& view, const BtfDirection& light,
                                                 std::size_t count) const {
    const DirectionPoint at = point(view, light);
    std::vector<TableWeight> found(points_.size());
    for (std::size_t i = 0; i < points_.size(); ++i) found[i] = {i, squared_distance(points_[i], at)};
    count = std::min(count, found.size());
    const auto nearer = [](const TableWeight& a, const TableWeight& b) {
        return a.weight != b.weight ? a.weight < b.weight : a.pair < b.pair;
    };
    std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count), found.end(), nearer);
    found.resize(count);
    for (TableWeight& pair : found) pair.weight = std::sqrt(pair.weight);
    return found;
}

std::vector<TableWeight> DirectionTable::interpolate(BtfDirection view, BtfDirection light) const {
    view.theta = std::min(view.theta, steepest_view_);
    light.theta = std::min(light.theta, steepest_light_);
    std::vector<TableWeight> found = nearest(view, light, plate_neighbours);
    if (found.front().weight * found.front().weight < same_place || found.size() == 1)
        return {{found.front().pair, 1.0}};
    const DirectionPoint at = point(view, light);
    MatrixXd points(static_cast<Index>(found.size()), static_cast<Index>(at.size()));
    for (Index i = 0; i < points.rows(); ++i)
        for (Index k = 0; k < points.cols(); ++k)
            points(i, k) = points_[found[static_cast<std::size_t>(i)].pair][static_cast<std::size_t>(k)] -
                           at[static_cast<std::size_t>(k)];
    const VectorXd weights = plate_weights(points);
    for (Index i = 0; i < weights.size(); ++i) found[static_cast<std::size_t>(i)].weight = weights[i];
    return found;
}

PictureWeights DirectionTable::weights(const BtfDirection& view, const BtfDirection& light) const {
    const BtfTables& tables = model_->tables;
    const auto colours = static_cast<std::size_t>(model_->colours), planes = tables.weight_units.size();
    PictureWeights result{std::vector<double>(colours), std::vector<double>(colours),
                          std::vector<double>(colours * planes)};
    for (const TableWeight& of : interpolate(view, light)) {
        const double upward = std::cos(light_of(of.pair).theta);
        for (std::size_t c = 0; c < colours; ++c) {
            const std::size_t row = of.pair * colours + c;
            // The logarithm of what a matt surface would have everywhere. A black picture is nearly so.
            const double mean = std::max(static_cast<double>(tables.mean[row]), 1e-7 * model_->white);
            result.mean[c] += of.weight * std::log(mean / upward);
            result.offsets[c] += of.weight * tables.offset_unit * tables.offsets[row];
            for (std::size_t k = 0; k < planes; ++k)
                result.weights[c * planes + k] +=
                    of.weight * tables.weight_units[k] * tables.weights[row * planes + k];
        }
    }
    const double upward = std::cos(std::min(light.theta, steepest_light_));
    for (double& mean : result.mean) mean = std::exp(mean) * upward;
    return result;
}

}  // namespace btfield::detail
