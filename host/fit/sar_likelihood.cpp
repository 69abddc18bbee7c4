#include "host/fit/sar_likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "btfield/error.hpp"
#include "btfield/fit.hpp"
#include "host/analysis/lag_matrices.hpp"
#include "host/analysis/working_basis.hpp"
#include "host/base/dense.hpp"
#include "host/base/text.hpp"
#include "host/base/work_part.hpp"
#include "host/fit/least_squares.hpp"
#include "host/fit/likelihood.hpp"
#include "host/fit/sar_newton.hpp"
#include "host/fit/sar_objective.hpp"
#include "host/spectrum/spectral_density.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::size_t;

/// Planes that repeat each other (a grey picture stored as RGB) are told apart by white noise of 10⁻⁸ of the
/// correlation's largest eigenvalue: no 8-bit picture shows it.
LagCovariance told_apart(const LagCovariance& statistic) {
    constexpr double least = 1e-8;
    LagCovariance result = statistic;
    const VectorXd values = correlation_eigenvalues(lag_zero(statistic));
    const double largest = values[values.size() - 1];
    if (values[0] > least * largest) return result;
    for (int i = 0; i < statistic.planes(); ++i)
        result.set(i, i, {}, (1.0 + least * largest) * statistic(i, i, {}));
    return result;
}

/// C(t − s) in the basis, rows and columns (s, j).
MatrixXd moments_in(const WorkingBasis& basis, const LagCovariance& statistic,
                    const std::vector<Offset>& terms) {
    const Index d = statistic.planes(), count = static_cast<Index>(terms.size());
    MatrixXd result(count * d, count * d), c(d, d);
    for (Index s = 0; s < count; ++s) {
        for (Index t = 0; t < count; ++t) {
            for (Index j = 0; j < d; ++j) {
                for (Index k = 0; k < d; ++k) {
                    c(j, k) = statistic(static_cast<int>(j), static_cast<int>(k),
                                        terms[static_cast<size_t>(t)] - terms[static_cast<size_t>(s)]);
                }
            }
            result.block(s * d, t * d, d, d) = congruent(basis.forward, c);
        }
    }
    return result;
}

/// The likelihood in the working basis, and the way from models to its unknowns and back. Unknowns of near
/// neighbours come first: those of the nearest few terms are a smaller model's.
class SarProblem {
  public:
    /// \param shape support, per-pair sets
    SarProblem(const LagCovariance& statistic, const SarModel& shape, NoiseForm noise)
        : shape_(shape),
          noise_(noise),
          // Uncorrelated planes where all pairs of planes are coupled; otherwise they are only scaled.
          // told_apart() leaves no eigenvalue near zero: the floor stands against rounding alone.
          basis_(
              working_basis(lag_zero(statistic),
                            noise == NoiseForm::full && shape.active.empty() ? Turn::principal : Turn::none,
                            {.absolute = 1e-14})) {
        sort_terms();
        make_layout();
        moments_ = moments_in(basis_, statistic, layout_.terms);
    }

    [[nodiscard]] const SarObjective::Layout& layout() const { return layout_; }
    [[nodiscard]] const SarModel& shape() const { return shape_; }
    [[nodiscard]] NoiseForm noise() const { return noise_; }
    [[nodiscard]] SarObjective objective(Index terms) const {
        SarObjective::Layout part = layout_;
        const Index d = shape_.planes;
        part.terms.resize(static_cast<size_t>(terms));
        part.place.resize(static_cast<size_t>(terms * d * d));
        part.unknowns = *std::max_element(part.place.begin(), part.place.end()) + 1;
        return {std::move(part), moments_.topLeftCorner(terms * d, terms * d)};
    }

    /// Numbers of terms of ever larger models, the centre alone excluded and the whole one included, each
    /// some half larger than the one before. Terms of equal length stay together.
    [[nodiscard]] std::vector<Index> stages() const {
        const auto count = static_cast<Index>(layout_.terms.size());
        std::vector<Index> result;
        for (Index k = 2; k < count; ++k) {
            if (length(layout_.terms[static_cast<size_t>(k)]) ==
                length(layout_.terms[static_cast<size_t>(k - 1)]))
                continue;
            if (2 * (k - 1) >= 3 * (result.empty() ? 2 : result.back() - 1)) result.push_back(k);
        }
        if (!result.empty() && 4 * (count - 1) < 5 * (result.back() - 1)) result.pop_back();
        result.push_back(count);
        return result;
    }

    /// B = I.
    [[nodiscard]] VectorXd white() const {
        VectorXd x = VectorXd::Zero(layout_.unknowns);
        const Index d = shape_.planes;
        for (Index i = 0; i < d; ++i) x[layout_.place[static_cast<size_t>(i * d + i)]] = 1.0;
        return x;
    }
    [[nodiscard]] VectorXd unknowns_of(const SarModel& model) const {
        const LinearField turned = change_basis(model, basis_.forward, basis_.inverse);
        const Index d = shape_.planes;
        const MatrixXd lower = noise_matrix(turned).llt().matrixL();
        const MatrixXd root = lower.triangularView<Eigen::Lower>().solve(MatrixXd::Identity(d, d));
        VectorXd x(layout_.unknowns);
        for (Index s = 0; s < static_cast<Index>(layout_.terms.size()); ++s) {
            MatrixXd b = root;
            if (s > 0) b = -root * block(turned.coefficients.data(), from_[static_cast<size_t>(s)]);
            for (Index e = 0; e < d * d; ++e) {
                const Index place = layout_.place[static_cast<size_t>(s * d * d + e)];
                if (place >= 0) x[place] = b(e / d, e % d);
            }
        }
        return x;
    }
    /// \param b entries of all b_s
    [[nodiscard]] SarModel model(const VectorXd& b) const {
        const Index d = shape_.planes;
        const MatrixXd root =
            block(b.data(), 0).triangularView<Eigen::Lower>().solve(MatrixXd::Identity(d, d));
        SarModel result = shape_;
        for (Index s = 1; s < static_cast<Index>(layout_.terms.size()); ++s) {
            Eigen::Map<RowMajorMatrix> a(result.coefficients.data() + from_[static_cast<size_t>(s)] * d * d,
                                         d, d);
            a = -(basis_.inverse * (root * block(b.data(), s)) * basis_.forward);
        }
        const MatrixXd colour = basis_.inverse * root;
        MatrixXd noise = colour * colour.transpose();
        if (noise_ == NoiseForm::diagonal) noise = MatrixXd(noise.diagonal().asDiagonal());
        for (Index i = 0; i < d; ++i) {
            for (Index j = 0; j < d; ++j)
                result.noise_covariance[static_cast<size_t>(i * d + j)] =
                    noise(std::min(i, j), std::max(i, j));
        }
        return result;
    }

    /// \param factor lower Cholesky factor of the Hessian
    /// \param pixels of the picture
    [[nodiscard]] std::vector<double> standard_errors(const VectorXd& b, const MatrixXd& factor,
                                                      double pixels) const {
        const Index d = shape_.planes, count = static_cast<Index>(layout_.terms.size());
        const MatrixXd root =
            block(b.data(), 0).triangularView<Eigen::Lower>().solve(MatrixXd::Identity(d, d));
        const MatrixXd left = basis_.inverse * root;
        // A_s = −T⁻¹ B_0⁻¹ b_s T, dA_s = −T⁻¹ B_0⁻¹ (db_s + dB_0 A'_s) T with A'_s = −B_0⁻¹ b_s.
        MatrixXd jacobian = MatrixXd::Zero(layout_.unknowns, (count - 1) * d * d);
        const auto add = [&](Index unknown, Index s, Index p, const Eigen::RowVectorXd& right) {
            if (unknown < 0) return;
            const Index first = from_[static_cast<size_t>(s)] * d * d;
            for (Index i = 0; i < d; ++i) {
                for (Index j = 0; j < d; ++j) jacobian(unknown, first + i * d + j) -= left(i, p) * right[j];
            }
        };
        for (Index s = 1; s < count; ++s) {
            const MatrixXd turned = -root * block(b.data(), s) * basis_.forward;
            for (Index p = 0; p < d; ++p) {
                for (Index q = 0; q < d; ++q) {
                    add(layout_.place[static_cast<size_t>(p * d + q)], s, p, turned.row(q));
                    add(layout_.place[static_cast<size_t>((s * d + p) * d + q)], s, p, basis_.forward.row(q));
                }
            }
        }
        // f is −2/M times the log-likelihood: the covariance of the unknowns is 2/M H⁻¹.
        const MatrixXd scaled = factor.triangularView<Eigen::Lower>().solve(jacobian);
        std::vector<double> result;
        for (Index k = 0; k < scaled.cols(); ++k)
            result.push_back(std::sqrt(2.0 / pixels) * scaled.col(k).norm());
        return result;
    }

  private:
    static int length(Offset s) { return s.row * s.row + s.column * s.column; }
    [[nodiscard]] MatrixXd block(const double* values, Index k) const {
        const Index d = shape_.planes;
        return Eigen::Map<const RowMajorMatrix>(values + k * d * d, d, d);
    }
    void sort_terms() {
        std::vector<Index> order(shape_.offsets.size());
        for (size_t k = 0; k < order.size(); ++k) order[k] = static_cast<Index>(k);
        std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) {
            return length(shape_.offsets[static_cast<size_t>(a)]) <
                   length(shape_.offsets[static_cast<size_t>(b)]);
        });
        layout_.terms.push_back({});
        from_.push_back(-1);
        for (const Index k : order) {
            layout_.terms.push_back(shape_.offsets[static_cast<size_t>(k)]);
            from_.push_back(k);
        }
    }
    void make_layout() {
        const Index d = shape_.planes;
        const std::vector<Offset>& terms = layout_.terms;
        layout_.planes = shape_.planes;
        layout_.place.assign(terms.size() * static_cast<size_t>(d * d), -1);
        for (Index i = 0; i < d; ++i) {
            for (Index j = 0; j <= i; ++j) {
                if (i == j || noise_ == NoiseForm::full)
                    layout_.place[static_cast<size_t>(i * d + j)] = layout_.unknowns++;
            }
        }
        layout_.real = d == 1 && shape_.active.empty() && is_symmetric();
        for (size_t s = 1; s < terms.size(); ++s) {
            if (layout_.real) {
                const auto opposite =
                    static_cast<size_t>(std::find(terms.begin(), terms.end(), -terms[s]) - terms.begin());
                layout_.place[s] = opposite < s ? layout_.place[opposite] : layout_.unknowns++;
                continue;
            }
            const Index first = from_[s] * d * d;
            for (Index e = 0; e < d * d; ++e) {
                if (!shape_.active.empty() && shape_.active[static_cast<size_t>(first + e)] == 0) continue;
                layout_.place[s * static_cast<size_t>(d * d) + static_cast<size_t>(e)] = layout_.unknowns++;
            }
        }
    }
    [[nodiscard]] bool is_symmetric() const {
        return std::all_of(shape_.offsets.begin(), shape_.offsets.end(), [&](Offset s) {
            return std::find(shape_.offsets.begin(), shape_.offsets.end(), -s) != shape_.offsets.end();
        });
    }

    SarModel shape_;
    NoiseForm noise_;
    WorkingBasis basis_;
    SarObjective::Layout layout_;
    std::vector<Index> from_;  ///< place of each term among the offsets
    MatrixXd moments_;
};

/// One end point.
struct SarCandidate {
    Descent end;
    SarModel model;
    Examination examination;
    int grid = 0;
    bool guarded = false;
    [[nodiscard]] bool valid() const { return examination.certificate.valid; }
};

class Fit {
  public:
    Fit(const LagCovariance& statistic, const SarModel& shape, NoiseForm noise,
        const LikelihoodOptions& options)
        : statistic_(statistic),
          options_(options),
          problem_(statistic, shape, noise),
          whole_(problem_.objective(static_cast<Index>(problem_.layout().terms.size()))) {}

    [[nodiscard]] int steps() const { return steps_; }
    [[nodiscard]] const SarProblem& problem() const { return problem_; }
    void set_pace(Pace pace) { pace_ = pace; }

    /// From white noise through smaller models.
    VectorXd grow(int side, SarObjective::Guard guard, double tolerance) {
        VectorXd x = problem_.white();
        for (const Index terms : problem_.stages()) {
            if (terms == static_cast<Index>(problem_.layout().terms.size())) break;
            SarObjective part = problem_.objective(terms);
            part.set_grid(side);
            part.set_guard(guard);
            const Index unknowns = part.layout().unknowns;
            x.head(unknowns) = run(part, x.head(unknowns), tolerance).x;
        }
        return x;
    }
    /// A causal model, by least squares on those terms that precede the centre in one of four raster orders:
    /// hardly ever has it zeros. Empty where no term precedes the centre.
    VectorXd causal(int scan) {
        const auto precedes = [&](Offset s) {
            if (scan % 2 == 1) s.column = -s.column;
            return scan < 2 ? s < Offset{} : Offset{s.column, s.row} < Offset{};
        };
        const SarModel& shape = problem_.shape();
        const size_t entries = static_cast<size_t>(shape.planes) * static_cast<size_t>(shape.planes);
        Support past;
        for (size_t s = 0; s < shape.offsets.size(); ++s) {
            if (!precedes(shape.offsets[s])) continue;
            past.offsets.push_back(shape.offsets[s]);
            if (shape.active.empty()) continue;
            const auto first = shape.active.begin() + static_cast<std::ptrdiff_t>(s * entries);
            past.active.insert(past.active.end(), first, first + static_cast<std::ptrdiff_t>(entries));
        }
        if (past.offsets.empty()) return {};
        const SarModel half = fit_sar(statistic_, past, problem_.noise());
        SarModel whole = shape;
        std::ranges::fill(whole.coefficients, 0.0);
        auto from = half.coefficients.begin();
        for (size_t s = 0; s < shape.offsets.size(); ++s) {
            if (!precedes(shape.offsets[s])) continue;
            std::copy_n(from, entries, whole.coefficients.begin() + static_cast<std::ptrdiff_t>(s * entries));
            from += static_cast<std::ptrdiff_t>(entries);
        }
        whole.noise_covariance = half.noise_covariance;
        return problem_.unknowns_of(whole);
    }
    /// Descends on ever finer grids. Where the guard is at work in the end, it is taken away; if the model is
    /// not valid without it, it stays.
    SarCandidate finish(VectorXd x, int first_side, int side, SarObjective::Guard guard) {
        double tolerance = first_tolerance;
        whole_.set_guard(guard);
        for (int grid = first_side; grid < side; grid *= 2) {
            whole_.set_grid(grid);
            SarCandidate coarse = examined(run(whole_, x, tolerance));
            // Finer grids hardly ever rid a model of its zeros.
            if (!coarse.valid()) return coarse;
            x = std::move(coarse.end.x);
            tolerance = pace_ == Pace::brisk ? middle_tolerance : loose_tolerance;
        }
        whole_.set_grid(side);
        SarCandidate result = examined(run(whole_, x, last_tolerance));
        if (!result.guarded || !result.valid()) return result;
        whole_.set_guard({});
        SarCandidate free = examined(run(whole_, result.end.x, last_tolerance));
        return free.valid() && free.end.converged ? free : result;
    }

    /// Descends from a valid model to a valid one, with the guard at work to the end: an end point where that
    /// has a minimum, and otherwise where the next step would leave the valid models.
    SarCandidate keep_valid(const VectorXd& x, int side, SarObjective::Guard guard) {
        // Each step is examined, which takes most of the time; later ones creep along the border of what is
        // valid, ever nearer to a zero of det Λ, and textures do not get better for it.
        constexpr int most_valid_steps = 30;
        whole_.set_guard(guard);
        whole_.set_grid(side);
        Descent end = descend(whole_, x, last_tolerance, std::min(options_.most_steps, most_valid_steps),
                              Pace::cautious, [&](const VectorXd& at) { return is_valid(at); });
        steps_ += end.steps;
        return examined(std::move(end));
    }
    [[nodiscard]] bool is_valid(const VectorXd& x) const {
        return examine(problem_.model(whole_.entries(x)), statistic_).certificate.valid;
    }

    /// f of a model on the grid of the last steps, without guard.
    double likelihood_of(const SarModel& model) {
        whole_.set_guard({});
        return whole_.value(problem_.unknowns_of(model));
    }

    std::vector<double> standard_errors(const SarCandidate& at) {
        whole_.set_guard({});
        whole_.set_grid(at.grid);
        (void)whole_.value(at.end.x);
        const Eigen::LLT<MatrixXd> factor(whole_.derivatives().hessian);
        if (factor.info() != Eigen::Success) return {};
        return problem_.standard_errors(whole_.entries(at.end.x), factor.matrixL(),
                                        static_cast<double>(area(statistic_.size())));
    }

  private:
    Descent run(SarObjective& objective, const VectorXd& x, double tolerance) {
        const WorkPart part(share_of_descent * (1.0 - work_counted()));
        Descent end = descend(objective, x, tolerance, options_.most_steps, pace_);
        steps_ += end.steps;
        return end;
    }
    SarCandidate examined(Descent end) {
        SarCandidate result;
        result.guarded = whole_.is_guarded();
        result.grid = whole_.side();
        result.model = problem_.model(whole_.entries(end.x));
        result.examination = examine(result.model, statistic_);
        result.end = std::move(end);
        return result;
    }
    static constexpr double first_tolerance = 1e-3, middle_tolerance = 1e-9, loose_tolerance = 1e-7,
                            last_tolerance = 1e-15;

    const LagCovariance& statistic_;
    const LikelihoodOptions& options_;
    SarProblem problem_;
    SarObjective whole_;
    Pace pace_ = Pace::brisk;
    int steps_ = 0;
};

/// With full Σ, rows of Σ^{-1/2} Λ are mixtures of an equation and those above it.
void check_sets(const SarModel& shape, NoiseForm noise) {
    if (noise == NoiseForm::diagonal || shape.active.empty()) return;
    const auto d = static_cast<size_t>(shape.planes);
    for (size_t s = 0; s < shape.offsets.size(); ++s) {
        for (size_t i = 1; i < d; ++i) {
            for (size_t j = 0; j < d; ++j) {
                if (shape.active[(s * d + i - 1) * d + j] <= shape.active[(s * d + i) * d + j]) continue;
                throw InputError("maximum-likelihood MSAR fit with full noise and per-pair sets",
                                 "plane " + std::to_string(i) + " has a neighbour that plane " +
                                     std::to_string(i + 1) + " lacks",
                                 "use diagonal noise, or sets that grow from plane to plane");
            }
        }
    }
}

size_t count_unknowns(const SarModel& shape, NoiseForm noise) {
    const auto d = static_cast<size_t>(shape.planes);
    const auto coefficients =
        shape.active.empty() ? shape.coefficients.size()
                             : static_cast<size_t>(std::count(shape.active.begin(), shape.active.end(), 1));
    return coefficients + (noise == NoiseForm::full ? d * (d + 1) / 2 : d);
}

}  // namespace

SarLikelihoodFit fit_sar_likelihood(const LagCovariance& data, const Support& support, NoiseForm noise,
                                    const LikelihoodOptions& options) {
    check_request(data, support);
    const LagCovariance statistic = told_apart(data);
    const SarModel least_squares = fit_sar(statistic, support, noise);
    check_sets(least_squares, noise);
    check_dense_hessian("maximum-likelihood fit of an MSAR model of " + counted(statistic.planes(), "plane"),
                        count_unknowns(least_squares, noise),
                        "use least squares (--estimator ls), a 2d-msar model, or a lower order");
    Fit fit(statistic, least_squares, noise, options);
    constexpr SarObjective::Guard usual{1.0, 2.0}, strong{10.0, 1.0};
    SarCandidate best = fit.finish(fit.grow(32, usual, 1e-2), 32, 128, usual);
    const auto consider = [&](SarCandidate other) {
        const bool better = other.valid() && other.end.likelihood < best.end.likelihood;
        if (!best.valid() || better) best = std::move(other);
    };
    // The objective has many optima, and which one is found depends on the way. White noise leads to the
    // better ones, causal models to those without zeros; near singular models small steps end at a valid one
    // more often than long ones.
    VectorXd valid_start = fit.problem().white();
    for (int scan = 0; scan < 4 && !best.valid(); ++scan) {
        const VectorXd start = fit.causal(scan);
        if (start.size() == 0) continue;
        consider(fit.finish(start, 32, 128, usual));
        if (scan == 0 && fit.is_valid(start)) valid_start = start;
    }
    if (!best.valid()) {
        fit.set_pace(Pace::cautious);
        consider(fit.finish(fit.grow(32, usual, 1e-2), 32, 128, usual));
    }
    if (!best.valid()) consider(fit.keep_valid(valid_start, 128, strong));
    // Least squares may be near a better optimum.
    if ((!best.valid() || fit.likelihood_of(least_squares) < best.end.likelihood) &&
        examine(least_squares, statistic).certificate.valid) {
        consider(fit.finish(fit.problem().unknowns_of(least_squares), 128, 128, usual));
    }

    SarLikelihoodFit result;
    result.log_likelihood =
        best.valid() ? log_likelihood(best.model, statistic, best.examination.log_determinant, {}, 0)
                     : std::numeric_limits<double>::quiet_NaN();
    if (options.standard_errors) result.standard_errors = fit.standard_errors(best);
    result.iterations = fit.steps();
    result.converged = best.end.converged;
    result.gradient = best.end.gradient;
    result.grid = best.grid;
    result.guarded = best.guarded;
    result.model = std::move(best.model);
    result.examination = std::move(best.examination);
    return result;
}

}  // namespace btfield::detail
