#include "host/fit/least_squares.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>

#include "btfield/error.hpp"
#include "btfield/fit.hpp"
#include "host/analysis/lag_matrices.hpp"
#include "host/base/eigen.hpp"
#include "host/base/text.hpp"

namespace btfield {

using namespace detail;
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::size_t;

/// V_xx, V_xy, V_yy of P4 eq. 2, per pixel: X stacks y_j(r ⊕ s), j fastest.
struct Moments {
    MatrixXd xx;  ///< ηd × ηd
    MatrixXd xy;  ///< ηd × d
    MatrixXd yy;  ///< d × d
};

Moments moments(const LagCovariance& statistic, const std::vector<Offset>& offsets) {
    const int d = statistic.planes();
    const auto count = static_cast<Index>(offsets.size());
    Moments v{MatrixXd(count * d, count * d), MatrixXd(count * d, d), lag_zero(statistic)};
    for (Index a = 0; a < count; ++a) {
        const Offset s = offsets[static_cast<size_t>(a)];
        for (int j = 0; j < d; ++j) {
            // E y_j(r ⊕ s) y_i(r) = C_ij(s); E y_j(r ⊕ s) y_k(r ⊕ t) = C_jk(t − s).
            for (int i = 0; i < d; ++i) v.xy(a * d + j, i) = statistic(i, j, s);
            for (Index b = 0; b < count; ++b) {
                const Offset t = offsets[static_cast<size_t>(b)];
                for (int k = 0; k < d; ++k) v.xx(a * d + j, b * d + k) = statistic(j, k, t - s);
            }
        }
    }
    return v;
}

/// E = V_yy − Θ V_xy − V_xyᵀ Θᵀ + Θ V_xx Θᵀ, theta being Θᵀ.
MatrixXd residual(const Moments& v, const MatrixXd& theta) {
    const MatrixXd cross = theta.transpose() * v.xy;
    const MatrixXd result = v.yy - cross - cross.transpose() + theta.transpose() * v.xx * theta;
    return 0.5 * (result + result.transpose());
}

}  // namespace

std::string detail::describe(const Support& support, int planes) {
    return "least-squares fit of " + counted(support.offsets.size(), "offset") + " to " +
           counted(planes, "plane");
}

void detail::check_request(const LagCovariance& statistic, const Support& support) {
    const std::vector<Offset>& offsets = support.offsets;
    const std::string asked = describe(support, statistic.planes());
    if (statistic.planes() < 1)
        throw InputError(asked, "the statistic is empty", "compute lag covariances first");
    if (offsets.empty()) throw InputError(asked, "the support is empty", "give at least one offset");
    const std::set<Offset> distinct(offsets.begin(), offsets.end());
    if (distinct.size() != offsets.size() || distinct.contains(Offset{})) {
        throw InputError(asked, "the support repeats an offset or holds the centre",
                         "list every offset once and leave (0, 0) out");
    }
    const auto d = static_cast<size_t>(statistic.planes());
    if (!support.active.empty() && support.active.size() != offsets.size() * d * d) {
        throw InputError(
            asked, "the per-pair sets have " + std::to_string(support.active.size()) + " entries",
            "give " + std::to_string(offsets.size() * d * d) + ", one per offset and pair of planes");
    }
    const Offset box = difference_box(offsets);
    if (!statistic.contains(box)) {
        throw InputError(asked, "the lag covariances do not reach all differences of the support",
                         "compute them with the support's difference_box");
    }
    for (int i = 0; i < statistic.planes(); ++i) {
        if (!(statistic(i, i, {}) > 0.0) || !std::isfinite(statistic(i, i, {}))) {
            throw InputError(asked, "plane " + std::to_string(i + 1) + " is constant",
                             "remove that plane or use a picture that varies");
        }
    }
}

MatrixXd detail::solve_normal_equations(const MatrixXd& xx, const MatrixXd& right,
                                        const std::vector<Index>& used, const std::string& asked) {
    const auto count = static_cast<Index>(used.size());
    VectorXd scale(count);
    for (Index a = 0; a < count; ++a)
        scale[a] = 1.0 / std::sqrt(xx(used[static_cast<size_t>(a)], used[static_cast<size_t>(a)]));
    MatrixXd scaled(count, count), b(count, right.cols());
    for (Index a = 0; a < count; ++a) {
        const Index row = used[static_cast<size_t>(a)];
        b.row(a) = scale[a] * right.row(row);
        for (Index c = 0; c < count; ++c)
            scaled(a, c) = scale[a] * xx(row, used[static_cast<size_t>(c)]) * scale[c];
    }
    const Eigen::LLT<MatrixXd> factor(scaled);
    // Below this reciprocal condition the solution has no correct digit left.
    const double limit = static_cast<double>(count) * std::numeric_limits<double>::epsilon();
    if (factor.info() != Eigen::Success || !(factor.rcond() > limit)) {
        throw InputError(
            asked, "the normal equations are singular (planes or neighbours depend on each other exactly)",
            "drop planes that repeat others, use fewer offsets or more pixels, or a 3d-car model, whose "
            "prior mends this");
    }
    return scale.asDiagonal() * factor.solve(b);
}

namespace {

/// Θᵀ, ηd × d, zero where a pair has no coefficient.
MatrixXd solve_all(const Moments& v, const Support& support, const std::string& asked) {
    const Index unknowns = v.xx.rows(), d = v.xy.cols();
    std::vector<Index> used;
    if (support.active.empty()) {
        for (Index k = 0; k < unknowns; ++k) used.push_back(k);
        return solve_normal_equations(v.xx, v.xy, used, asked);
    }
    MatrixXd theta = MatrixXd::Zero(unknowns, d);
    for (Index i = 0; i < d; ++i) {
        used.clear();
        for (Index k = 0; k < unknowns; ++k) {
            const auto at = [](Index index) { return static_cast<size_t>(index); };
            if (support.has(at(k / d), at(i), at(k % d), at(d))) used.push_back(k);
        }
        if (used.empty()) continue;
        const VectorXd column = solve_normal_equations(v.xx, v.xy.col(i), used, asked);
        for (Index a = 0; a < static_cast<Index>(used.size()); ++a)
            theta(used[static_cast<size_t>(a)], i) = column[a];
    }
    return theta;
}

}  // namespace

MatrixXd detail::admissible_noise(const MatrixXd& noise, NoiseForm form, const MatrixXd& yy) {
    const VectorXd deviation = yy.diagonal().cwiseSqrt();
    const VectorXd inverse = deviation.cwiseInverse();
    MatrixXd scaled = inverse.asDiagonal() * noise * inverse.asDiagonal();
    if (form == NoiseForm::diagonal) scaled = MatrixXd(scaled.diagonal().asDiagonal());
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(scaled);
    const VectorXd& values = solver.eigenvalues();
    const double lowest = std::max(1e-8 * values.maxCoeff(), 1e-14);
    if (!(values.minCoeff() >= lowest)) {
        const MatrixXd& vectors = solver.eigenvectors();
        scaled = vectors * values.cwiseMax(lowest).asDiagonal() * vectors.transpose();
        scaled = (0.5 * (scaled + scaled.transpose())).eval();
    }
    return deviation.asDiagonal() * scaled * deviation.asDiagonal();
}

namespace {

/// Where an equation holds neighbours of one plane only, on a support with s and −s, least squares gives a_s
/// = a_{−s}, because C_ii(s) = C_ii(−s). Rounding must not spoil that: Λ of such a plane is real, and its
/// zeros are curves.
void make_symmetric(MatrixXd& theta, const Support& support) {
    const std::vector<Offset>& offsets = support.offsets;
    const Index d = theta.cols();
    const auto has = [&](Index s, Index i, Index j) {
        return support.has(static_cast<size_t>(s), static_cast<size_t>(i), static_cast<size_t>(j),
                           static_cast<size_t>(d));
    };
    for (Index i = 0; i < d; ++i) {
        bool alone = d == 1 || !support.active.empty();
        const auto count = static_cast<Index>(offsets.size());
        std::vector<Index> opposite(offsets.size(), -1);
        for (Index s = 0; s < count && alone; ++s) {
            for (Index j = 0; j < d; ++j) {
                if (j != i && has(s, i, j)) alone = false;
            }
            const auto found = std::find(offsets.begin(), offsets.end(), -offsets[static_cast<size_t>(s)]);
            if (found == offsets.end()) {
                alone = false;
                break;
            }
            opposite[static_cast<size_t>(s)] = static_cast<Index>(found - offsets.begin());
            if (has(s, i, i) != has(opposite[static_cast<size_t>(s)], i, i)) alone = false;
        }
        if (!alone) continue;
        const VectorXd before = theta.col(i);
        for (Index s = 0; s < count; ++s) {
            const Index other = opposite[static_cast<size_t>(s)];
            theta(s * d + i, i) = 0.5 * (before[s * d + i] + before[other * d + i]);
        }
    }
}

}  // namespace

void detail::fill(LinearField& field, const Support& support, const MatrixXd& theta, const MatrixXd& noise) {
    const auto d = static_cast<int>(noise.rows());
    field.planes = d;
    static_cast<Support&>(field) = support;
    for (size_t s = 0; s < support.offsets.size(); ++s) {
        for (int i = 0; i < d; ++i) {
            for (int j = 0; j < d; ++j) field.coefficients.push_back(theta(static_cast<Index>(s) * d + j, i));
        }
    }
    for (int i = 0; i < d; ++i) {
        for (int j = 0; j < d; ++j) field.noise_covariance.push_back(noise(std::min(i, j), std::max(i, j)));
    }
}

MatrixXd detail::residual_covariance(const LinearField& field, const LagCovariance& statistic) {
    const int d = field.planes;
    MatrixXd theta(static_cast<Index>(field.offsets.size()) * d, d);
    for (Index k = 0; k < theta.rows(); ++k) {
        for (Index i = 0; i < d; ++i) {
            theta(k, i) = field.coefficients[static_cast<size_t>((k / d * d + i) * d + k % d)];
        }
    }
    return residual(moments(statistic, field.offsets), theta);
}

CarModel fit_car(const LagCovariance& statistic, const Support& support, NoiseForm noise,
                 const BayesPrior& prior) {
    check_request(statistic, support);
    const std::string asked = describe(support, statistic.planes());
    for (const Offset s : support.offsets) {
        if (!(s < Offset{})) {
            throw InputError("CAR fit",
                             "the offset " + text_of(s) + " does not precede the centre in raster order",
                             "use a causal or unilateral neighbourhood, or a 3d-msar model");
        }
    }
    if (!(prior.strength >= 0.0) || !std::isfinite(prior.strength) || !(prior.beta0 > 1.0) ||
        !std::isfinite(prior.beta0)) {
        throw InputError("CAR fit", "the prior has a negative strength or beta0 <= 1",
                         "use strength >= 0 and beta0 > 1");
    }
    Moments v = moments(statistic, support.offsets);
    const double pixels = static_cast<double>(area(statistic.size()));
    const Index d = v.yy.rows();
    // V / M: the prior adds strength / M of each plane's own variance to the diagonal of V_xx.
    for (Index k = 0; k < v.xx.rows(); ++k) v.xx(k, k) += prior.strength / pixels * v.yy(k % d, k % d);
    const MatrixXd theta = solve_all(v, support, asked);
    const MatrixXd sigma = residual(v, theta) * (pixels / (pixels + prior.beta0));
    CarModel model;
    fill(model, support, theta, admissible_noise(sigma, noise, v.yy));
    return model;
}

SarModel fit_sar(const LagCovariance& statistic, const Support& support, NoiseForm noise) {
    check_request(statistic, support);
    const Moments v = moments(statistic, support.offsets);
    MatrixXd theta = solve_all(v, support, describe(support, statistic.planes()));
    make_symmetric(theta, support);
    SarModel model;
    fill(model, support, theta, admissible_noise(residual(v, theta), noise, v.yy));
    return model;
}

}  // namespace btfield
