#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "btfield/error.hpp"
#include "host/analysis/lag_matrices.hpp"
#include "host/analysis/working_basis.hpp"
#include "host/base/dense.hpp"
#include "host/base/lane_inverse.hpp"
#include "host/base/work_part.hpp"
#include "host/fit/folded_periodogram.hpp"
#include "host/fit/likelihood.hpp"
#include "host/fit/mrf_likelihood.hpp"
#include "host/fit/mrf_sweep.hpp"
#include "host/fit/mrf_unknowns.hpp"
#include "host/spectrum/positive_everywhere.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::size_t;

// Most descents take 10 to 30 steps; what takes more crawls along a narrow valley.
constexpr int most_steps = 60;
// Of the data's, in a model that is kept.
constexpr double most_variance = 1.05;

/// a + aᴴ
LaneMatrix twice_hermitian_part(const LaneMatrix& a) {
    LaneMatrix result = adjoint(a);
    add(result, a, 1.0);
    return result;
}

/// result += scale · (column k of a) (row l of b)
void add_outer(const LaneMatrix& a, int k, const LaneMatrix& b, int l, double scale, LaneMatrix& result) {
    const int d = a.planes();
    for (int i = 0; i < d; ++i) {
        for (int j = 0; j < d; ++j)
            add_lane_product(a.real(i, k), b.real(l, j), result.real(i, j), a.lanes(), scale);
    }
}

/// The unknowns: Λ, whose constant is the identity, and B = Σ^{−1/2}.
struct Point {
    HermitianPolynomial lambda;
    MatrixXd root;  ///< B
};

class Whittle {
  public:
    Whittle(const HalfSupport& support, int planes, bool full, const FrequencyGrid& cells,
            std::vector<LaneMatrix> periodogram)
        : planes_(planes),
          unknowns_(mrf_unknowns(support, planes, ConstantForm::none)),
          roots_(mrf_unknowns({}, planes, full ? ConstantForm::full : ConstantForm::diagonal)),
          pairs_(planes),
          reach_(support.reach),
          cells_(cells),
          periodogram_(std::move(periodogram)),
          waves_(cells_.column, reach_.column),
          lags_(cells_, reach_),
          twice_(cells_, {2 * reach_.row, 2 * reach_.column}) {}

    [[nodiscard]] VectorXd vector(const Point& point) const {
        VectorXd x(lags() + roots());
        x.head(lags()) = collect(unknowns_, point.lambda);
        for (Index k = 0; k < roots(); ++k) x[lags() + k] = point.root(root(k).i, root(k).j);
        return x;
    }
    [[nodiscard]] Point point(const VectorXd& x, const Point& like) const {
        Point p = like;
        assign(unknowns_, x.head(lags()), p.lambda);
        for (Index k = 0; k < roots(); ++k) {
            p.root(root(k).i, root(k).j) = x[lags() + k];
            p.root(root(k).j, root(k).i) = x[lags() + k];
        }
        return p;
    }
    [[nodiscard]] Offset reach() const { return reach_; }
    [[nodiscard]] Index lags() const { return static_cast<Index>(unknowns_.size()); }
    [[nodiscard]] Index roots() const { return static_cast<Index>(roots_.size()); }

    /// Nothing where Λ or B is not positive definite.
    [[nodiscard]] std::optional<double> value(const Point& p, const Lattice& lattice) const {
        const Eigen::LLT<MatrixXd> factor(p.root);
        if (factor.info() != Eigen::Success) return std::nullopt;
        const RowBlocks blocks(cell_rows());
        std::vector<double> sums(static_cast<size_t>(blocks.count));
        const std::optional<double> positive = sweep_rows(
            p.lambda, cells_, waves_, Sweep::everything,
            [&](int block, size_t m, const LaneMatrix& inverse, const LaneMatrix& lambda) {
                const LaneMatrix x = product(p.root, lambda);
                const LaneMatrix wi = detail::product(detail::product(inverse, x), periodogram_[m]);
                const double sum = mean_trace(adjoint(x), wi, cells_.column_weight);  // X = B Λ
                sums[static_cast<size_t>(block)] += cells_.row_weight[m] * sum;
            });
        if (!positive) return std::nullopt;
        const std::optional<double> logarithm =
            sweep_rows(p.lambda, lattice.grid, lattice.waves, Sweep::logarithm,
                       [](int, size_t, const LaneMatrix&, const LaneMatrix&) {});
        if (!logarithm) return std::nullopt;
        const MatrixXd lower = factor.matrixL();
        double f = -4.0 * lower.diagonal().array().log().sum();
        for (const double sum : sums) f += sum;
        return f - *logarithm;
    }

    struct Derivatives {
        VectorXd gradient;
        MatrixXd hessian;  ///< its mixed block is to be scaled by the caller
    };
    [[nodiscard]] Derivatives derivatives(const Point& p, const Lattice& lattice) const {
        const auto zero = [&](const LagTransform& transform, Index functions) {
            return sums_of_blocks(cell_rows(), transform, functions);
        };
        DataSums sums{zero(lags_, triangle() * (1 + roots())), zero(lags_, triangle()), zero(twice_, pairs()),
                      zero(twice_, pairs())};
        sweep_rows(p.lambda, cells_, waves_, Sweep::everything,
                   [&](int block, size_t m, const LaneMatrix& inverse, const LaneMatrix& lambda) {
                       const Products at(p.root, inverse, lambda, periodogram_[m], constant(p.root));
                       add_first(at, m, static_cast<size_t>(block), sums);
                       add_second(at, m, static_cast<size_t>(block), sums);
                   });
        Derivatives result{VectorXd(lags() + roots()), MatrixXd(lags() + roots(), lags() + roots())};
        set_data_part(sums, result);
        add_barrier(p.lambda, lattice, result);
        add_determinant_of_root(p.root, result);
        return result;
    }

  private:
    /// L = Λ⁻¹, W = L B Λ and their products with the periodogram I along one row.
    struct Products {
        const LaneMatrix &l, &data;
        LaneMatrix bl, lb, blb, wi, iw, wiw, il, lil, wil, bwi;
        Products(const MatrixXd& root, const LaneMatrix& inverse, const LaneMatrix& lambda,
                 const LaneMatrix& periodogram, const LaneMatrix& constant_root)
            : l(inverse),
              data(periodogram),
              bl(product(root, l)),
              lb(adjoint(bl)),
              blb(product(bl, constant_root)) {
            const LaneMatrix w = product(lb, lambda);
            wi = product(w, data);
            iw = adjoint(wi);
            wiw = product(wi, adjoint(w));
            il = product(data, lambda);
            lil = product(lambda, il);
            wil = product(wi, lambda);
            bwi = product(root, wi);
        }
    };
    /// Sums of the blocks: K, then the K of every derivative by B; 2 Re W I Λ; Φ of Λ, and of B.
    struct DataSums {
        std::vector<LagSums> first, root_first, second, root_second;
    };
    void add_first(const Products& at, size_t m, size_t place, DataSums& sums) const {
        RowMajorMatrix rows((1 + roots()) * 2 * triangle(), static_cast<Index>(cells_.column.size())), part;
        LaneMatrix k = twice_hermitian_part(at.bwi);
        add(k, at.wiw, -1.0);
        lower_triangle(k, part);
        rows.topRows(2 * triangle()) = part;
        for (Index r = 0; r < roots(); ++r) {
            LaneMatrix z(planes_, at.data.lanes());
            const int i = root(r).i, j = root(r).j;
            for (int turn = 0; turn < (i == j ? 1 : 2); ++turn) {
                const int from = turn == 0 ? i : j, to = turn == 0 ? j : i;  // F = e_from e_toᵀ
                add_row(at.wi, to, from, z);
                add_outer(at.wil, from, at.l, to, -1.0, z);
                add_outer(at.il, from, at.lb, to, 1.0, z);
            }
            lower_triangle(twice_hermitian_part(z), part);
            rows.middleRows(2 * triangle() * (1 + r), 2 * triangle()) = part;
        }
        sums.first[place].add(m, rows);
        lower_triangle(twice_hermitian_part(at.wil), part);
        sums.root_first[place].add(m, part);
    }
    void add_second(const Products& at, size_t m, size_t place, DataSums& sums) const {
        RowMajorMatrix products = RowMajorMatrix::Zero(2 * pairs(), static_cast<Index>(cells_.column.size()));
        const auto both = [&](const LaneMatrix& x, const LaneMatrix& y, double scale) {
            pairs_.add_products(x, y, scale, products);
            pairs_.add_products(y, x, scale, products);
        };
        both(at.blb, at.data, 1.0);
        both(at.bl, at.wi, -1.0);
        both(at.lb, at.iw, -1.0);
        both(at.l, at.wiw, 1.0);
        sums.second[place].add(m, products);
        products.setZero();
        both(at.l, at.lil, 1.0);
        sums.root_second[place].add(m, products);
    }
    /// Derivatives of mean_t tr(Λ B Λ⁻¹ B Λ I_t).
    void set_data_part(DataSums& sums, Derivatives& result) const {
        const LagMeans moments = means_of(sums.first);
        result.gradient.head(lags()) = traces(unknowns_, moments);
        result.gradient.tail(roots()) = traces(roots_, means_of(sums.root_first));
        result.hessian.topLeftCorner(lags(), lags()) =
            second_traces(unknowns_, pairs_, means_of(sums.second));
        result.hessian.bottomRightCorner(roots(), roots()) =
            second_traces(roots_, pairs_, means_of(sums.root_second));
        for (Index r = 0; r < roots(); ++r) {
            const VectorXd mixed = traces(unknowns_, moments, triangle() * (1 + r));
            result.hessian.block(0, lags() + r, lags(), 1) = mixed;
            result.hessian.block(lags() + r, 0, 1, lags()) = mixed.transpose();
        }
    }
    /// Those of −mean_t ln det Λ_t.
    void add_barrier(const HermitianPolynomial& lambda, const Lattice& lattice, Derivatives& result) const {
        std::vector<LagSums> first = sums_of_blocks(lattice.rows(), lattice.lags, triangle());
        std::vector<LagSums> second = sums_of_blocks(lattice.rows(), lattice.twice, pairs());
        sweep_rows(lambda, lattice.grid, lattice.waves, Sweep::inverse,
                   [&](int block, size_t m, const LaneMatrix& l, const LaneMatrix&) {
                       RowMajorMatrix rows;
                       lower_triangle(l, rows);
                       first[static_cast<size_t>(block)].add(m, rows);
                       rows.setZero(2 * pairs(), static_cast<Index>(lattice.columns()));
                       pairs_.add_products(l, l, 1.0, rows);
                       second[static_cast<size_t>(block)].add(m, rows);
                   });
        result.gradient.head(lags()) -= traces(unknowns_, means_of(first));
        result.hessian.topLeftCorner(lags(), lags()) += second_traces(unknowns_, pairs_, means_of(second));
    }
    /// Those of −2 ln det B.
    void add_determinant_of_root(const MatrixXd& b, Derivatives& result) const {
        const MatrixXd inverse = b.inverse();
        for (Index r = 0; r < roots(); ++r) {
            const MatrixXd change = inverse * elementary(r) * inverse;
            result.gradient[lags() + r] -= 2.0 * (inverse * elementary(r)).trace();
            for (Index q = 0; q < roots(); ++q)
                result.hessian(lags() + r, lags() + q) += 2.0 * (change * elementary(q)).trace();
        }
    }
    [[nodiscard]] Index triangle() const { return Index{planes_} * (planes_ + 1) / 2; }
    [[nodiscard]] Index pairs() const { return static_cast<Index>(pairs_.pairs().size()); }
    [[nodiscard]] int cell_rows() const { return static_cast<int>(cells_.row.size()); }
    [[nodiscard]] const MrfUnknown& root(Index k) const { return roots_[static_cast<size_t>(k)]; }
    [[nodiscard]] MatrixXd elementary(Index k) const {
        MatrixXd e = MatrixXd::Zero(planes_, planes_);
        e(root(k).i, root(k).j) = e(root(k).j, root(k).i) = 1.0;
        return e;
    }
    [[nodiscard]] LaneMatrix constant(const MatrixXd& a) const {
        LaneMatrix result(planes_, cells_.column.size());
        for (int i = 0; i < planes_; ++i) {
            for (int j = 0; j < planes_; ++j) std::fill_n(result.real(i, j), result.lanes(), a(i, j));
        }
        return result;
    }
    /// Row `to` of z += row `from` of a: z + e_to e_fromᵀ a.
    static void add_row(const LaneMatrix& a, int from, int to, LaneMatrix& z) {
        for (int j = 0; j < a.planes(); ++j) {
            const double* const source = a.real(from, j);
            double* const goal = z.real(to, j);
            for (size_t n = 0; n < 2 * a.lanes(); ++n) goal[n] += source[n];
        }
    }
    int planes_;
    std::vector<MrfUnknown> unknowns_, roots_;
    PairTable pairs_;
    Offset reach_;
    FrequencyGrid cells_;
    std::vector<LaneMatrix> periodogram_;
    Waves waves_;
    LagTransform lags_, twice_;
};

/// Newton step; the mixed second derivatives count as far as the Hessian stays positive definite.
VectorXd newton_step(const Whittle::Derivatives& at, Index lags) {
    const Index roots = at.gradient.size() - lags;
    const VectorXd scale = at.hessian.diagonal().cwiseAbs().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    MatrixXd h = scale.asDiagonal() * at.hessian * scale.asDiagonal();
    const VectorXd g = scale.asDiagonal() * at.gradient;
    for (int attempt = 0; attempt < 8; ++attempt) {
        const Eigen::LLT<MatrixXd> factor(h);
        if (factor.info() == Eigen::Success) return scale.asDiagonal() * factor.solve(-g);
        const double less = attempt < 6 ? 0.6 : 0.0;
        h.topRightCorner(lags, roots) *= less;
        h.bottomLeftCorner(roots, lags) *= less;
    }
    return -(scale.asDiagonal() * g);
}

struct PmrfDescent {
    Point point;
    double value = 0.0, start = 0.0, gradient = 0.0;
    int iterations = 0;
    bool converged = false;
};

PmrfDescent descend(const Whittle& whittle, const Point& start, const MrfLikelihoodOptions& options) {
    constexpr GridDensity base = {64, 16, 0, 0};
    PmrfDescent result;
    result.point = start;
    std::optional<Lattice> lattice;
    lattice.emplace(resolving(start.lambda, base), whittle.reach());
    std::optional<double> value = whittle.value(start, *lattice);
    if (!value) return result;
    result.start = *value;
    const WorkPart part(0.9 * (1.0 - work_counted()));
    while (true) {
        work_nearer(0.3 * share_of_step);  // steps are small ones here
        const GridDensity needed = resolving(result.point.lambda, base);
        if (needed.row_levels > lattice->density.row_levels ||
            needed.column_levels > lattice->density.column_levels) {
            lattice.emplace(needed, whittle.reach());
            const std::optional<double> again = whittle.value(result.point, *lattice);
            if (!again) break;
            value = again;
        }
        result.value = *value;
        const Whittle::Derivatives at = whittle.derivatives(result.point, *lattice);
        const VectorXd step = newton_step(at, whittle.lags());
        const double slope = at.gradient.dot(step);
        // Newton's decrement: how much lower the objective could get.
        result.gradient = std::sqrt(std::max(0.0, -slope));
        if (!(slope < 0.0) || result.gradient < 1e-6) {
            result.converged = std::isfinite(slope);
            break;
        }
        if (result.iterations >= std::min(options.max_iterations, most_steps)) break;
        const VectorXd x = whittle.vector(result.point);
        double length = 1.0;
        std::optional<double> next;
        Point candidate;
        for (; length > 1e-9; length *= 0.5) {
            candidate = whittle.point(x + length * step, result.point);
            next = whittle.value(candidate, *lattice);
            if (next && *next <= *value + 1e-4 * length * slope) break;
            next.reset();
        }
        if (!next) {
            // Nothing that the rounding of the objective lets through: fine where there was nothing to gain.
            result.converged = result.gradient < 1e-3;
            break;
        }
        ++result.iterations;
        // Steps that gain less than any two seeds differ are not worth their time.
        const bool slow = *value - *next < 1e-8 && result.gradient < 1e-3;
        result.point = std::move(candidate);
        value = next;
        if (slow) {
            result.value = *value;
            result.converged = true;
            break;
        }
    }
    // The start is the same model on the last grid.
    if (const std::optional<double> there = whittle.value(start, *lattice)) result.start = *there;
    return result;
}

/// What the steps of a fit have in common.
struct Frame {
    const LagCovariance& statistic;
    HalfSupport support;
    MrfModel shape;      ///< all but its numbers
    WorkingBasis basis;  ///< orthogonal
    double white = 0.0;  ///< variance of the white noise that tells apart planes which repeat each other
    [[nodiscard]] int planes() const { return shape.planes; }
};

void check_request(const HalfSupport& support, const FoldedPeriodogram& periodogram, int planes,
                   const char* asked) {
    if (periodogram.rows.empty() || periodogram.rows.front().planes() != planes) {
        throw InputError(asked, "the periodogram is not that of the picture",
                         "compute both from the same picture");
    }
    const auto d = static_cast<size_t>(planes);
    check_dense_hessian(asked, support.offsets.size() * d * d + d,
                        "use least squares (--estimator ls), a 2d-pmrf or 3d-mmrf model, or a lower order");
}

/// Λ and Σ^{1/2} turn with the planes in orthogonal bases only: no scaling, and so no floor; white noise
/// takes its place.
void set_basis(Frame& frame, bool full) {
    const Index d = frame.planes();
    const MatrixXd c0 = lag_zero(frame.statistic);
    if (full && frame.shape.has_all()) {
        frame.basis = working_basis(c0, Turn::rotation);
    } else {
        frame.basis = {MatrixXd::Identity(d, d), MatrixXd::Identity(d, d)};
    }
    const MatrixXd& turn = frame.basis.forward;
    frame.white = 1e-8 * congruent(turn, c0).diagonal().maxCoeff();
}

/// Covariances of plane i of the basis, at lags of the support.
LagCovariance plane_statistic(const Frame& frame, int i) {
    const MatrixXd& turn = frame.basis.forward;
    const auto covariance = [&](Offset s) {
        double sum = 0.0;
        for (int a = 0; a < frame.planes(); ++a) {
            for (int b = 0; b < frame.planes(); ++b)
                sum += turn(i, a) * turn(i, b) * frame.statistic(a, b, s);
        }
        return sum;
    };
    LagCovariance plane(1, frame.statistic.size(), frame.support.reach);
    plane.set(0, 0, {}, std::max(covariance({}), 0.0) + frame.white);
    for (const Offset s : frame.support.offsets) plane.set(0, 0, s, covariance(s));
    return plane;
}

/// Offsets at which plane i has itself.
Support plane_support(const Frame& frame, int i) {
    Support own{NeighbourhoodKind::custom, frame.shape.offsets};
    if (frame.shape.has_all()) return own;
    const auto d = static_cast<size_t>(frame.planes()), place = static_cast<size_t>(i);
    for (size_t s = 0; s < own.offsets.size(); ++s)
        own.active.push_back(frame.shape.has(s, place, place, d) ? 1 : 0);
    return own;
}

/// Independent planes, each by its own fit.
Point independent_planes(const Frame& frame, const MrfLikelihoodOptions& options, MrfLikelihoodFit& fit) {
    const int d = frame.planes();
    Point start{{MatrixXd::Identity(d, d), frame.support.offsets, {}}, MatrixXd::Zero(d, d)};
    start.lambda.terms.assign(frame.support.offsets.size(), MatrixXd::Zero(d, d));
    fit.converged = true;
    const WorkPart part(0.3);
    for (int i = 0; i < d; ++i) {
        const WorkPart plane(1.0 / d);
        const MrfLikelihoodFit one =
            fit_mmrf_ml(plane_statistic(frame, i), plane_support(frame, i), NoiseForm::full, options);
        fit.iterations += one.iterations;
        fit.penalty = std::max(fit.penalty, one.penalty);
        fit.converged = fit.converged && one.converged;
        for (size_t s = 0; s < frame.support.offsets.size(); ++s)
            start.lambda.terms[s](i, i) = one.model.coefficients[frame.support.position[s]];
        start.root(i, i) = 1.0 / std::sqrt(one.model.noise_covariance.front());
    }
    return start;
}

/// I of the planes of the basis, white noise included.
std::vector<LaneMatrix> turned_periodogram(const Frame& frame, const FoldedPeriodogram& periodogram) {
    const MatrixXd& turn = frame.basis.forward;
    std::vector<LaneMatrix> turned;
    for (const LaneMatrix& row : periodogram.rows) {
        LaneMatrix both = adjoint(product(turn, adjoint(product(turn, row))));
        for (int i = 0; i < both.planes(); ++i) {
            for (size_t n = 0; n < both.lanes(); ++n) both.real(i, i)[n] += frame.white;
        }
        turned.push_back(std::move(both));
    }
    return turned;
}

/// The model in the planes of the picture.
MrfModel model_at(const Frame& frame, const Point& point) {
    const Index d = frame.planes();
    const auto block = static_cast<size_t>(d * d);
    const MatrixXd& turn = frame.basis.forward;
    MrfModel model = frame.shape;
    model.coefficients.resize(model.offsets.size() * block);
    for (size_t s = 0; s < frame.support.offsets.size(); ++s) {
        const MatrixXd a = congruent(turn.transpose(), point.lambda.terms[s]);
        Eigen::Map<RowMajorMatrix>(model.coefficients.data() + frame.support.position[s] * block, d, d) = a;
        Eigen::Map<RowMajorMatrix>(model.coefficients.data() + frame.support.mirror[s] * block, d, d) =
            a.transpose();
    }
    const MatrixXd root = congruent(turn.transpose(), point.root.inverse());
    const MatrixXd sigma = root * root;
    model.noise_covariance.resize(block);
    Eigen::Map<RowMajorMatrix>(model.noise_covariance.data(), d, d) = 0.5 * (sigma + sigma.transpose());
    return model;
}

/// Takes the point's model, its proof and its certificate into the fit.
void take(const Frame& frame, const Point& point, const PositiveDefiniteness& proof, MrfLikelihoodFit& fit) {
    fit.certified = proof.proven;
    fit.min_eigenvalue = proof.min_eigenvalue;
    fit.model = model_at(frame, point);
    fit.examination = examine(fit.model, frame.statistic);
    fit.variance_ratio = fit.examination->certificate.variance_ratio;
}

/// Takes the point where it is proven, certified and has no more variance than the data.
bool take_credible(const Frame& frame, const Point& point, MrfLikelihoodFit& fit) {
    const PositiveDefiniteness proof = positive_everywhere(point.lambda);
    if (!proof.proven) return false;
    take(frame, point, proof, fit);
    return fit.examination->certificate.valid &&
           std::ranges::all_of(fit.variance_ratio, [](double ratio) { return ratio <= most_variance; });
}

/// Takes the end of a descent. Where it is indefinite between the nodes, or so nearly that hardly any
/// frequency holds all of the variance: back towards the start, which is valid, as little as will do.
bool take_end(const Frame& frame, const Whittle& whittle, const Point& start, Point& end,
              MrfLikelihoodFit& fit) {
    const VectorXd last = whittle.vector(end), first = whittle.vector(start);
    bool taken = take_credible(frame, end, fit);
    for (double back = 1.0 / 4096.0; back <= 1.0 && !taken; back *= 2.0) {
        end = whittle.point(last + back * (first - last), start);
        taken = take_credible(frame, end, fit);
    }
    return taken;
}

}  // namespace

MrfLikelihoodFit fit_pmrf_ml(const LagCovariance& statistic, const FoldedPeriodogram& periodogram,
                             const Support& whole, NoiseForm noise, const MrfLikelihoodOptions& options) {
    const char* asked = "maximum-likelihood fit of a pseudo-Markov random field";
    const int d = statistic.planes();
    if (d == 1) {
        MrfLikelihoodFit fit = fit_mmrf_ml(statistic, whole, noise, options);
        fit.model.form = MrfForm::pmrf;
        return fit;
    }
    const bool full = noise == NoiseForm::full;
    Frame frame{statistic, half_support(statistic, whole, asked), {}, {}};
    check_request(frame.support, periodogram, d, asked);
    frame.shape.form = MrfForm::pmrf;
    frame.shape.planes = d;
    static_cast<Support&>(frame.shape) = whole;
    set_basis(frame, full);

    MrfLikelihoodFit fit;
    const Point start = independent_planes(frame, options, fit);
    const Whittle whittle(frame.support, d, full, periodogram.grid, turned_periodogram(frame, periodogram));
    PmrfDescent end = descend(whittle, start, options);
    const bool taken = take_end(frame, whittle, start, end.point, fit);
    const Lattice lattice(resolving(end.point.lambda, {128, 24, 0, 0}), whittle.reach());
    constexpr double none = std::numeric_limits<double>::infinity();
    fit.objective = whittle.value(end.point, lattice).value_or(none);
    fit.start_objective = whittle.value(start, lattice).value_or(end.start);
    if (!taken || !(fit.objective <= fit.start_objective)) {
        end.converged = false;
        fit.objective = fit.start_objective;
        take(frame, start, positive_everywhere(start.lambda), fit);
    }
    fit.iterations += end.iterations;
    fit.converged = fit.converged && end.converged;
    fit.gradient = end.gradient;
    return fit;
}

}  // namespace btfield::detail
