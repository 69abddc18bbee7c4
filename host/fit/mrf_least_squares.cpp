#include "host/fit/mrf_least_squares.hpp"

#include <algorithm>
#include <numeric>
#include <string>

#include "btfield/error.hpp"
#include "host/analysis/lag_matrices.hpp"
#include "host/base/dense.hpp"
#include "host/base/text.hpp"
#include "host/fit/least_squares.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::size_t;

/// Normal equations of that many unknowns take 600 MB, and their solution a minute.
constexpr Index most_unknowns = 6000;

/// One of each ±s, and where both are in the list of offsets.
struct OffsetPair {
    Offset step;  ///< lexicographically positive
    size_t forward = 0, backward = 0;
};

std::vector<OffsetPair> pairs_of(const std::vector<Offset>& offsets, const std::string& asked) {
    std::vector<OffsetPair> pairs;
    for (size_t s = 0; s < offsets.size(); ++s) {
        const auto found = std::find(offsets.begin(), offsets.end(), -offsets[s]);
        if (found == offsets.end()) {
            throw InputError(asked, "the support has " + text_of(offsets[s]) + " but not its opposite",
                             "use a symmetric neighbourhood for Markov random fields");
        }
        if (offsets[s] > Offset{})
            pairs.push_back({offsets[s], s, static_cast<size_t>(found - offsets.begin())});
    }
    return pairs;
}

/// An entry of a P_s: p_{s,i,j} = p_{−s,j,i}.
struct Unknown {
    size_t pair = 0;
    Index i = 0, j = 0;
};

/// The model, in planes where P_{−s} = P_sᵀ.
struct SymmetricField {
    const LagCovariance* statistic;
    std::vector<OffsetPair> pairs;
    std::vector<Unknown> unknowns;

    SymmetricField(const LagCovariance& covariances, const Support& support, const std::string& asked)
        : statistic(&covariances), pairs(pairs_of(support.offsets, asked)) {
        const auto d = static_cast<size_t>(covariances.planes());
        const auto exists = [&](size_t s, size_t i, size_t j) { return support.has(s, i, j, d); };
        for (size_t p = 0; p < pairs.size(); ++p)
            for (size_t i = 0; i < d; ++i)
                for (size_t j = 0; j < d; ++j) {
                    if (exists(pairs[p].forward, i, j) != exists(pairs[p].backward, j, i)) {
                        throw InputError(asked, "the per-pair sets are not symmetric",
                                         "with (s, i, j) list (-s, j, i) too");
                    }
                    if (exists(pairs[p].forward, i, j))
                        unknowns.push_back({p, static_cast<Index>(i), static_cast<Index>(j)});
                }
        if (static_cast<Index>(unknowns.size()) > most_unknowns) {
            throw InputError(
                asked, std::to_string(unknowns.size()) + " joint unknowns do not fit into memory",
                "use a lower order, fewer planes, or a model whose planes are fitted one by one");
        }
    }

    /// P_s per pair that minimises mean_r Σ_i w_i e_{r,i}², e = z − Σ_s (P_s z(r ⊕ s) + P_sᵀ z(r ⊖ s)), z =
    /// turn · Y.
    [[nodiscard]] std::vector<MatrixXd> least_squares(const MatrixXd& turn, const VectorXd& weights,
                                                      const std::string& asked) const;
};

/// C(s) of the turned planes at every lag that is asked for, each computed once.
class TurnedCovariance {
  public:
    TurnedCovariance(const LagCovariance& statistic, const MatrixXd& turn, Offset box) : box_(box) {
        const int d = statistic.planes();
        MatrixXd c(d, d);
        for (int row = -box.row; row <= box.row; ++row)
            for (int column = -box.column; column <= box.column; ++column) {
                for (int i = 0; i < d; ++i)
                    for (int j = 0; j < d; ++j) c(i, j) = statistic(i, j, {row, column});
                values_.push_back(congruent(turn, c));
            }
    }
    [[nodiscard]] const MatrixXd& operator()(Offset s) const {
        const int place = (s.row + box_.row) * (2 * box_.column + 1) + s.column + box_.column;
        return values_[static_cast<size_t>(place)];
    }

  private:
    Offset box_;
    std::vector<MatrixXd> values_;
};

std::vector<MatrixXd> SymmetricField::least_squares(const MatrixXd& turn, const VectorXd& weights,
                                                    const std::string& asked) const {
    Offset box;
    for (const OffsetPair& p : pairs) {
        box.row = std::max(box.row, 2 * std::abs(p.step.row));
        box.column = std::max(box.column, 2 * std::abs(p.step.column));
    }
    const TurnedCovariance c(*statistic, turn, box);
    const auto count = static_cast<Index>(unknowns.size());
    MatrixXd normal(count, count), right(count, 1);
    // p_{s,i,j} stands beside z_j(r ⊕ s) in the equation of plane i and beside z_i(r ⊖ s) in that of plane j.
    for (Index a = 0; a < count; ++a) {
        const Unknown& u = unknowns[static_cast<size_t>(a)];
        const Offset s = pairs[u.pair].step;
        right(a, 0) = (weights[u.i] + weights[u.j]) * c(s)(u.i, u.j);
        for (Index b = 0; b <= a; ++b) {
            const Unknown& v = unknowns[static_cast<size_t>(b)];
            const Offset t = pairs[v.pair].step;
            double sum = 0.0;
            if (u.i == v.i) sum += weights[u.i] * c(t - s)(u.j, v.j);
            if (u.i == v.j) sum += weights[u.i] * c(-t - s)(u.j, v.i);
            if (u.j == v.i) sum += weights[u.j] * c(t - (-s))(u.i, v.j);
            if (u.j == v.j) sum += weights[u.j] * c(s - t)(u.i, v.i);
            normal(a, b) = normal(b, a) = sum;
        }
    }
    std::vector<Index> all(unknowns.size());
    std::iota(all.begin(), all.end(), Index{0});
    const MatrixXd solution = all.empty() ? right : solve_normal_equations(normal, right, all, asked);
    std::vector<MatrixXd> result(pairs.size(), MatrixXd::Zero(turn.rows(), turn.cols()));
    for (size_t a = 0; a < unknowns.size(); ++a)
        result[unknowns[a].pair](unknowns[a].i, unknowns[a].j) = solution(static_cast<Index>(a), 0);
    return result;
}

/// Θᵀ of A_s = R P_s R⁻¹, A_{−s} = R P_sᵀ R⁻¹.
MatrixXd turned_back(const SymmetricField& field, const std::vector<MatrixXd>& p, const MatrixXd& root) {
    const Index d = root.rows();
    const MatrixXd inverse = root.inverse();
    MatrixXd theta(2 * static_cast<Index>(field.pairs.size()) * d, d);
    for (size_t s = 0; s < p.size(); ++s) {
        const OffsetPair& pair = field.pairs[s];
        theta.middleRows(static_cast<Index>(pair.forward) * d, d) = (root * p[s] * inverse).transpose();
        theta.middleRows(static_cast<Index>(pair.backward) * d, d) =
            (root * p[s].transpose() * inverse).transpose();
    }
    return theta;
}

/// R of Σ = R Rᵀ: diagonal for diagonal noise, so that per-pair sets stay.
MatrixXd root_of(const MatrixXd& sigma, NoiseForm form) {
    if (form == NoiseForm::diagonal) return sigma.diagonal().cwiseSqrt().asDiagonal();
    return sigma.llt().matrixL();
}

MrfModel model_of(MrfForm form, const Support& support, const MatrixXd& theta, const MatrixXd& sigma) {
    MrfModel model;
    fill(model, support, theta, sigma);
    model.form = form;
    return model;
}

double largest(const std::vector<MatrixXd>& p) {
    double value = 0.0;
    for (const MatrixXd& m : p) value = std::max(value, m.cwiseAbs().maxCoeff());
    return value;
}

}  // namespace

MrfEstimate fit_mmrf(const LagCovariance& statistic, const Support& support, NoiseForm noise,
                     const MrfLeastSquaresOptions& options) {
    check_request(statistic, support);
    const std::string asked = describe(support, statistic.planes());
    if (options.iterations < 1 || !(options.tolerance >= 0.0))
        throw InputError(asked, "fewer than one iteration or a negative tolerance", "use the defaults");
    if (noise == NoiseForm::full && !support.has_all()) {
        throw InputError(asked, "per-pair sets with full noise: the symmetry of one breaks the other",
                         "use diagonal noise, or every pair of planes at every offset");
    }
    const SymmetricField field(statistic, support, asked);
    const MatrixXd yy = lag_zero(statistic);
    const Index d = yy.rows();
    const bool full = noise == NoiseForm::full;

    MatrixXd sigma = full ? admissible_noise(yy, noise, yy) : MatrixXd(MatrixXd::Identity(d, d));
    std::vector<MatrixXd> p, before;
    MrfEstimate result;
    result.converged = false;
    for (result.iterations = 1;; ++result.iterations) {
        const MatrixXd root = root_of(sigma, noise);
        const VectorXd weights = full ? VectorXd(VectorXd::Ones(d)) : VectorXd(sigma.diagonal());
        before = std::move(p);
        p = field.least_squares(root.inverse(), weights, asked);
        const MatrixXd theta = turned_back(field, p, root);
        result.model = model_of(MrfForm::mmrf, support, theta, sigma);
        sigma = admissible_noise(residual_covariance(result.model, statistic), noise, yy);
        if (!before.empty()) {
            double moved = 0.0;
            for (size_t s = 0; s < p.size(); ++s)
                moved = std::max(moved, (p[s] - before[s]).cwiseAbs().maxCoeff());
            result.converged = moved <= options.tolerance * largest(p);
        }
        if (result.converged || result.iterations == options.iterations) break;
    }
    // Symmetric with the very Σ that the model has.
    result.model = model_of(MrfForm::mmrf, support, turned_back(field, p, root_of(sigma, noise)), sigma);
    return result;
}

MrfEstimate fit_pmrf(const LagCovariance& statistic, const Support& support, NoiseForm noise) {
    check_request(statistic, support);
    const std::string asked = describe(support, statistic.planes());
    const SymmetricField field(statistic, support, asked);
    const MatrixXd yy = lag_zero(statistic), identity = MatrixXd::Identity(yy.rows(), yy.cols());
    const MatrixXd theta =
        turned_back(field, field.least_squares(identity, VectorXd::Ones(yy.rows()), asked), identity);
    MrfEstimate result;
    result.model = model_of(MrfForm::pmrf, support, theta, identity);
    const MatrixXd sigma = admissible_noise(residual_covariance(result.model, statistic), noise, yy);
    result.model = model_of(MrfForm::pmrf, support, theta, sigma);
    return result;
}

}  // namespace btfield::detail
