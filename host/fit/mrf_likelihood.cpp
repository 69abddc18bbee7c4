#include "host/fit/mrf_likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "btfield/error.hpp"
#include "host/analysis/lag_matrices.hpp"
#include "host/analysis/working_basis.hpp"
#include "host/base/dense.hpp"
#include "host/base/work_part.hpp"
#include "host/fit/mrf_sweep.hpp"
#include "host/fit/mrf_unknowns.hpp"
#include "host/spectrum/positive_everywhere.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::size_t;

// Beyond this many unknowns the Hessian is not formed: conjugate gradients need only its products with
// vectors.
constexpr Index most_explicit = 1500;
// Grids: while far from the optimum, near it, and the most that any picture gets.
constexpr GridDensity coarse_grid = {32, 12, 0, 0};
constexpr GridDensity fine = {64, 16, 0, 0};
// Uniform nodes: where the plain problem needs more than the first, it is not worth having; the second is for
// the penalised one.
constexpr int most_uniform = 128, most_penalised = 256;
// Difference of covariances, relative, that passes when the grid cannot be refined further.
constexpr double acceptable = 1e-5;
// In sides of the picture.
constexpr double longest_wave = 4.0;

/// The convex problem in the basis that it is solved in.
class MrfProblem {
  public:
    MrfProblem(HalfSupport support, std::vector<MrfUnknown> unknowns, VectorXd data, int planes)
        : support_(std::move(support)),
          unknowns_(std::move(unknowns)),
          data_(std::move(data)),
          pairs_(static_cast<Index>(unknowns_.size()) <= most_explicit ? planes : 0),
          planes_(planes) {}

    [[nodiscard]] HermitianPolynomial polynomial(const VectorXd& x) const {
        HermitianPolynomial q;
        q.centre.setZero(planes_, planes_);
        q.offsets = support_.offsets;
        q.terms.assign(support_.offsets.size(), MatrixXd::Zero(planes_, planes_));
        assign(unknowns_, x, q);
        return q;
    }
    [[nodiscard]] const std::vector<MrfUnknown>& unknowns() const { return unknowns_; }
    [[nodiscard]] Offset reach() const { return support_.reach; }

    /// Adds ½ weight · mean_t tr(S_t²), S = Q⁻¹, to the objective: convex too, and infinite for infinitely
    /// long waves.
    void set_penalty(double weight) { penalty_ = weight; }

    /// The objective; nothing where Q is not positive definite on the grid.
    [[nodiscard]] std::optional<double> value(const VectorXd& x, const Lattice& lattice) const {
        std::vector<double> squares(static_cast<size_t>(RowBlocks(lattice.rows()).count));
        const std::optional<double> mean =
            sweep(polynomial(x), lattice, penalty_ > 0.0, [&](int block, size_t m, const LaneMatrix& s) {
                if (!(penalty_ > 0.0)) return;
                double sum = 0.0;
                for (int i = 0; i < planes_; ++i) {
                    for (int j = 0; j < planes_; ++j) {
                        const double* re = s.real(i, j);
                        const double* im = s.imaginary(i, j);
                        for (size_t n = 0; n < s.lanes(); ++n)
                            sum += lattice.grid.column_weight[n] * (re[n] * re[n] + im[n] * im[n]);
                    }
                }
                squares[static_cast<size_t>(block)] += lattice.grid.row_weight[m] * sum;
            });
        if (!mean) return std::nullopt;
        double sum = 0.0;
        for (const double square : squares) sum += square;
        return data_.dot(x) - *mean + 0.5 * penalty_ * sum;
    }
    /// ∂f: data's minus model's covariances (with the penalty: those of S + weight S³), as `traces` arranges
    /// them.
    [[nodiscard]] VectorXd gradient(const VectorXd& x, const Lattice& lattice) const {
        std::vector<LagSums> sums = sums_of_blocks(lattice.rows(), lattice.lags, triangle());
        sweep(polynomial(x), lattice, true, [&](int block, size_t m, const LaneMatrix& s) {
            RowMajorMatrix rows;
            lower_triangle(s, rows);
            if (penalty_ > 0.0) {
                RowMajorMatrix cubes;
                lower_triangle(product(product(s, s), s), cubes);
                rows += penalty_ * cubes;
            }
            sums[static_cast<size_t>(block)].add(m, rows);
        });
        return data_ - traces(unknowns_, means_of(sums));
    }
    struct Derivatives {
        VectorXd gradient;
        MatrixXd hessian;
    };
    /// Hessian: traces of Φ = S⊗S + weight (S⊗S³ + S²⊗S² + S³⊗S).
    [[nodiscard]] Derivatives derivatives(const VectorXd& x, const Lattice& lattice) const {
        const auto count = static_cast<Index>(pairs_.pairs().size());
        std::vector<LagSums> second = sums_of_blocks(lattice.rows(), lattice.twice, count);
        sweep(polynomial(x), lattice, true, [&](int block, size_t m, const LaneMatrix& s) {
            RowMajorMatrix rows = RowMajorMatrix::Zero(2 * count, static_cast<Index>(lattice.columns()));
            pairs_.add_products(s, s, 1.0, rows);
            if (penalty_ > 0.0) {
                const LaneMatrix square = product(s, s), cube = product(square, s);
                pairs_.add_products(square, square, penalty_, rows);
                pairs_.add_products(s, cube, penalty_, rows);
                pairs_.add_products(cube, s, penalty_, rows);
            }
            second[static_cast<size_t>(block)].add(m, rows);
        });
        return {gradient(x, lattice), second_traces(unknowns_, pairs_, means_of(second))};
    }
    /// H v = traces of S V S (+ weight (S V S³ + S² V S² + S³ V S)), V the polynomial of v.
    [[nodiscard]] VectorXd hessian_times(const VectorXd& x, const VectorXd& v, const Lattice& lattice) const {
        std::vector<LagSums> sums = sums_of_blocks(lattice.rows(), lattice.lags, triangle());
        const HermitianPolynomial direction = polynomial(v);
        sweep(polynomial(x), lattice, true, [&](int block, size_t m, const LaneMatrix& s) {
            LaneMatrix change(planes_, lattice.columns());
            evaluate(direction, lattice.grid.row[m], lattice.waves, change);
            change.complete_hermitian();
            RowMajorMatrix rows;
            const LaneMatrix once = product(product(s, change), s);
            lower_triangle(once, rows);
            if (penalty_ > 0.0) {
                const LaneMatrix square = product(s, s);
                for (const LaneMatrix& term :
                     {product(once, square), product(product(s, once), s), product(square, once)}) {
                    RowMajorMatrix more;
                    lower_triangle(term, more);
                    rows += penalty_ * more;
                }
            }
            sums[static_cast<size_t>(block)].add(m, rows);
        });
        return traces(unknowns_, means_of(sums));
    }
    /// Model's covariance at lag 0.
    [[nodiscard]] MatrixXd covariance(const VectorXd& x, const Lattice& lattice) const {
        std::vector<LagSums> sums = sums_of_blocks(lattice.rows(), lattice.lags, triangle());
        sweep(polynomial(x), lattice, true, [&](int block, size_t m, const LaneMatrix& s) {
            RowMajorMatrix rows;
            lower_triangle(s, rows);
            sums[static_cast<size_t>(block)].add(m, rows);
        });
        return mean_of(means_of(sums), planes_);
    }

  private:
    [[nodiscard]] Index triangle() const { return Index{planes_} * (planes_ + 1) / 2; }
    /// Calls visit(block, m, Q⁻¹ or rubbish) for every row m.
    /// \return mean ln det Q, nothing when indefinite
    template <class Visit>
    static std::optional<double> sweep(const HermitianPolynomial& q, const Lattice& lattice, bool invert,
                                       const Visit& visit) {
        return sweep_rows(
            q, lattice.grid, lattice.waves, invert ? Sweep::inverse : Sweep::logarithm,
            [&](int block, size_t m, const LaneMatrix& s, const LaneMatrix&) { visit(block, m, s); });
    }
    HalfSupport support_;
    std::vector<MrfUnknown> unknowns_;
    VectorXd data_;
    PairTable pairs_;
    int planes_;
    double penalty_ = 0.0;
};

/// Conjugate gradients on H step = −g to a relative residual.
VectorXd conjugate_gradients(const MrfProblem& problem, const VectorXd& x, const VectorXd& gradient,
                             const Lattice& lattice, double relative) {
    VectorXd step = VectorXd::Zero(x.size()), residual = -gradient, direction = residual;
    double power = residual.squaredNorm();
    const double goal = relative * relative * power;
    for (Index k = 0; k < x.size() && power > goal; ++k) {
        const VectorXd image = problem.hessian_times(x, direction, lattice);
        const double along = direction.dot(image);
        if (!(along > 0.0)) break;
        step += power / along * direction;
        residual -= power / along * image;
        const double next = residual.squaredNorm();
        direction = residual + next / power * direction;
        power = next;
    }
    return step;
}

struct Minimum {
    VectorXd x;
    double value = 0.0, gradient = 0.0;
    int iterations = 0;
    bool converged = false, too_long = false;
    GridDensity density;  ///< of a grid that resolves Q⁻¹
};

/// Largest difference of covariances: the gradient counts those off the diagonal and at lags twice.
double mismatch(const MrfProblem& problem, const VectorXd& gradient) {
    double largest = 0.0;
    for (Index k = 0; k < gradient.size(); ++k) {
        const double scale = 2.0 * std::abs(problem.unknowns()[static_cast<size_t>(k)].scale());
        const double difference = std::abs(gradient[k]) / scale;
        if (!(difference <= largest)) largest = difference;  // NaN stays
    }
    return largest;
}

/// A descent on grids that are refined as it needs them.
class Minimisation {
  public:
    /// \param start  positive definite everywhere
    /// \param limit  of the reach in pixels: beyond it, the search ends with too_long
    /// \param most_nodes  uniform ones, of the finest grid
    Minimisation(const MrfProblem& problem, const VectorXd& start, double limit, int most_nodes,
                 const MrfLikelihoodOptions& options)
        : problem_(problem), start_(start), limit_(limit), most_nodes_(most_nodes), options_(options) {}

    /// \param from   where to begin, positive definite
    Minimum run(const VectorXd& from) {
        const WorkPart part(2.0 * share_of_descent * (1.0 - work_counted()));
        x_ = from;
        move_to(resolving(problem_.polynomial(x_), base_));
        if (!value_) return result_;
        while (follow_peaks()) {
            work_nearer(share_of_step);
            const MrfProblem::Derivatives at = derivatives();
            const double off = mismatch(problem_, at.gradient);
            record(off);
            if (!std::isfinite(off)) break;
            if (base_ == coarse_grid && off < 1e-2) {
                base_ = fine;
                if (!refine(resolving(problem_.polynomial(x_), base_))) break;
            } else if (off < options_.tolerance) {
                if (!check_on_finer_grid()) break;
            } else if (result_.iterations >= options_.max_iterations || !advance(at, off)) {
                break;
            }
        }
        return result_;
    }

  private:
    void move_to(const GridDensity& density) {
        lattice_.emplace(density, problem_.reach());
        value_ = problem_.value(x_, *lattice_);
    }
    /// What is positive definite between the nodes of one grid may not be on another: the way back to the
    /// start is inside the convex set of those that are.
    bool refine(const GridDensity& density) {
        move_to(density);
        for (int k = 0; !value_ && k < 60; ++k) {
            x_ = 0.5 * (x_ + start_);
            value_ = problem_.value(x_, *lattice_);
        }
        return value_.has_value();
    }
    /// Peaks sharpen on the way to the optimum.
    bool follow_peaks() {
        const HermitianPolynomial q = problem_.polynomial(x_);
        const Reach reach = correlation_reach(q);
        if (reach.row > limit_ || reach.column > limit_) {
            result_.too_long = true;
            return false;
        }
        const GridDensity needed = resolving(q, base_);
        const bool resolved = needed.row_levels <= lattice_->density.row_levels &&
                              needed.column_levels <= lattice_->density.column_levels;
        return resolved || refine(needed);
    }
    [[nodiscard]] bool explicitly() const { return x_.size() <= most_explicit; }
    [[nodiscard]] MrfProblem::Derivatives derivatives() const {
        if (explicitly()) return problem_.derivatives(x_, *lattice_);
        return {problem_.gradient(x_, *lattice_), {}};
    }
    void record(double off) {
        result_.x = x_;
        result_.value = *value_;
        result_.gradient = off;
        result_.density = lattice_->density;
    }
    /// Is the sum the integral? A finer grid says.
    /// \return whether to go on, on that grid
    bool check_on_finer_grid() {
        GridDensity finer = resolving(problem_.polynomial(x_), base_);
        finer.uniform *= 2;
        finer.per_level += finer.per_level / 2;
        finer.row_levels = std::min(10, finer.row_levels + 1);
        finer.column_levels = std::min(10, finer.column_levels + 1);
        const Lattice other(finer, problem_.reach());
        const std::optional<double> there = problem_.value(x_, other);
        const double outside = there ? mismatch(problem_, problem_.gradient(x_, other)) : 1.0;
        result_.gradient = outside;
        if (there) result_.density = finer;
        if (there && outside < 10.0 * options_.tolerance) {
            result_.value = *there;
            result_.converged = true;
            return false;
        }
        if (base_.uniform >= most_nodes_) {
            result_.converged = there && outside < acceptable;
            return false;
        }
        if (result_.iterations >= options_.max_iterations) return false;
        base_.uniform = finer.uniform;
        base_.per_level = finer.per_level;
        return refine(finer);
    }
    [[nodiscard]] VectorXd direction(const MrfProblem::Derivatives& at, double off) const {
        if (!explicitly()) {
            return conjugate_gradients(problem_, x_, at.gradient, *lattice_, std::min(0.1, std::sqrt(off)));
        }
        const Eigen::LDLT<MatrixXd> factor(at.hessian);
        return factor.solve(-at.gradient);
    }
    /// One of Newton's, shortened until the objective falls.
    /// \return false where none does
    bool advance(const MrfProblem::Derivatives& at, double off) {
        const VectorXd step = direction(at, off);
        const double slope = at.gradient.dot(step);
        if (!(slope < 0.0)) return false;
        ++result_.iterations;
        // Where the predicted gain drowns in the rounding of the objective, Newton's step is taken as it is.
        const bool close = -slope < 1e-9 * (1.0 + std::abs(*value_));
        for (double length = 1.0; length > 1e-12; length *= 0.5) {
            const std::optional<double> next = problem_.value(x_ + length * step, *lattice_);
            if (!next || !(close || *next <= *value_ + 1e-4 * length * slope)) continue;
            x_ += length * step;
            value_ = next;
            return true;
        }
        return false;
    }

    const MrfProblem& problem_;
    const VectorXd& start_;
    double limit_;
    int most_nodes_;
    const MrfLikelihoodOptions& options_;
    Minimum result_;
    VectorXd x_;
    GridDensity base_ = coarse_grid;
    std::optional<Lattice> lattice_;
    std::optional<double> value_;
};

/// Σ = Q_0⁻¹ and A_s = Q_0⁻¹ Q_s in the planes of the picture.
MrfModel field_of(const HermitianPolynomial& q, const WorkingBasis& basis, const HalfSupport& support,
                  size_t offsets) {
    const Index d = q.centre.rows();
    const auto block = static_cast<size_t>(d * d);
    MrfModel model;
    model.planes = static_cast<int>(d);
    model.coefficients.resize(offsets * block);
    const Eigen::LLT<MatrixXd> factor(q.centre);
    const auto store = [&](const MatrixXd& term, size_t place) {
        const MatrixXd a = basis.inverse * factor.solve(term) * basis.forward;
        Eigen::Map<RowMajorMatrix>(model.coefficients.data() + place * block, d, d) = a;
    };
    for (size_t s = 0; s < q.terms.size(); ++s) {
        store(q.terms[s], support.position[s]);
        store(q.terms[s].transpose(), support.mirror[s]);
    }
    const MatrixXd sigma = congruent(basis.inverse, factor.solve(MatrixXd::Identity(d, d)));
    model.noise_covariance.resize(block);
    Eigen::Map<RowMajorMatrix>(model.noise_covariance.data(), d, d) = 0.5 * (sigma + sigma.transpose());
    return model;
}

void check_request(const MatrixXd& c0, const Support& whole, bool full, const char* asked) {
    for (Index i = 0; i < c0.rows(); ++i) {
        if (!(c0(i, i) > 0.0) || !std::isfinite(c0(i, i))) {
            throw InputError(asked, "plane " + std::to_string(i + 1) + " does not vary",
                             "remove that plane or use a picture that varies");
        }
    }
    if (full && !whole.has_all() && c0.rows() > 1) {
        throw InputError(asked, "per-pair sets of a 3d-mmrf hold for its A_s only when the noise is diagonal",
                         "use diagonal noise, or every pair at every offset");
    }
}

/// Derivatives of tr(Q_0 C(0)) − 2 Σ tr(Q_s C(s)ᵀ) by the unknowns, C in the basis.
/// \param zero C(0)
VectorXd data_terms(const LagCovariance& statistic, const WorkingBasis& basis, const MatrixXd& zero,
                    const std::vector<MrfUnknown>& unknowns) {
    VectorXd data(static_cast<Index>(unknowns.size()));
    MatrixXd c = zero;
    for (size_t k = 0; k < unknowns.size(); ++k) {
        const MrfUnknown& u = unknowns[k];
        if (k > 0 && u.offset != unknowns[k - 1].offset)
            c = congruent(basis.forward, lag_matrix(statistic, u.offset));
        data[static_cast<Index>(k)] = 2.0 * u.scale() * c(u.i, u.j);
    }
    return data;
}

struct Solution {
    Minimum minimum;  ///< of the last descent
    VectorXd x;
    PositiveDefiniteness proof;
    int iterations = 0;
    double penalty = 0.0;
};

/// A support that is too small for a smooth picture makes up for the variance that it cannot give with ever
/// longer waves: exponentially long ones on the infinite lattice, beyond float64. Waves longer than `longest`
/// are then given up, and with them the part of the variance that only they could carry.
Solution solve(MrfProblem& problem, const VectorXd& x0, double longest, const MrfLikelihoodOptions& options) {
    Solution end;
    end.minimum = Minimisation(problem, x0, longest, most_uniform, options).run(x0);
    end.x = end.minimum.x.size() > 0 ? end.minimum.x : x0;
    end.proof = positive_everywhere(problem.polynomial(end.x));
    end.iterations = end.minimum.iterations;
    double penalty = 50.0 / (longest * longest);
    for (int attempt = 0; attempt < 5 && !(end.minimum.converged && end.proof.proven);
         ++attempt, penalty *= 16.0) {
        problem.set_penalty(penalty);
        end.penalty = penalty;
        const VectorXd from = attempt == 0 && end.proof.proven ? end.x : x0;
        constexpr double no_limit = std::numeric_limits<double>::infinity();
        end.minimum = Minimisation(problem, x0, no_limit, most_penalised, options).run(from);
        if (end.minimum.x.size() > 0) end.x = end.minimum.x;
        end.iterations += end.minimum.iterations;
        end.proof = positive_everywhere(problem.polynomial(end.x));
    }
    problem.set_penalty(0.0);
    return end;
}

/// What is to be said of a solution, the model itself excepted.
MrfLikelihoodFit report_of(const Solution& solution, const MrfProblem& problem, const VectorXd& x0,
                           const WorkingBasis& basis, const MatrixXd& c0) {
    MrfLikelihoodFit fit;
    const double units = -2.0 * std::log(std::abs(basis.forward.determinant()));
    const Lattice lattice(solution.minimum.density, problem.reach());
    constexpr double none = std::numeric_limits<double>::infinity();
    fit.objective = problem.value(solution.x, lattice).value_or(none) + units;
    fit.start_objective = problem.value(x0, lattice).value_or(solution.minimum.value) + units;
    fit.iterations = solution.iterations;
    fit.penalty = solution.penalty;
    fit.gradient = solution.minimum.gradient;
    fit.converged = solution.minimum.converged;
    fit.certified = solution.proof.proven;
    fit.min_eigenvalue = solution.proof.min_eigenvalue;
    const MatrixXd p0 = congruent(basis.inverse, problem.covariance(solution.x, lattice));
    for (Index i = 0; i < c0.rows(); ++i) fit.variance_ratio.push_back(p0(i, i) / c0(i, i));
    return fit;
}

}  // namespace

MrfLikelihoodFit fit_mmrf_ml(const LagCovariance& statistic, const Support& whole, NoiseForm noise,
                             const MrfLikelihoodOptions& options) {
    const char* asked = "maximum-likelihood fit of a Markov random field";
    const HalfSupport support = half_support(statistic, whole, asked);
    const int d = statistic.planes();
    const bool full = noise == NoiseForm::full;
    const MatrixXd c0 = lag_zero(statistic);
    check_request(c0, whole, full, asked);
    // With full noise the problem does not depend on the basis. Planes that repeat each other are told apart
    // by what no 8-bit picture shows: 1e-8 of the largest eigenvalue.
    const WorkingBasis basis = working_basis(c0, full ? Turn::principal : Turn::none, {.relative = 1e-8});
    // White noise, 1e-9 of the variance, keeps the optimum finite for pictures without any, and lifts planes
    // that repeat others (their eigenvalue in the whitened basis) to 1.
    MatrixXd zero = congruent(basis.forward, c0);
    if (full) zero = MatrixXd::Identity(d, d);
    zero.diagonal().array() += 1e-9;
    std::vector<MrfUnknown> unknowns =
        mrf_unknowns(support, d, full ? ConstantForm::full : ConstantForm::diagonal);
    VectorXd data = data_terms(statistic, basis, zero, unknowns);
    MrfProblem problem(support, std::move(unknowns), std::move(data), d);

    HermitianPolynomial start =
        problem.polynomial(VectorXd::Zero(static_cast<Index>(problem.unknowns().size())));
    // Planes that repeat each other make C(0) singular: what is not turned starts from the variances alone.
    start.centre = full ? zero.inverse() : MatrixXd(zero.diagonal().cwiseInverse().asDiagonal());
    const VectorXd x0 = collect(problem.unknowns(), start);
    const double longest =
        std::max(64.0, longest_wave * std::max(statistic.size().height, statistic.size().width));
    const Solution solution = solve(problem, x0, longest, options);
    MrfLikelihoodFit fit = report_of(solution, problem, x0, basis, c0);
    fit.model = field_of(problem.polynomial(solution.x), basis, support, whole.offsets.size());
    static_cast<Support&>(fit.model) = whole;
    return fit;
}

}  // namespace btfield::detail
