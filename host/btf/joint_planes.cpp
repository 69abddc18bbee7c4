#include "host/btf/joint_planes.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "btfield/threads.hpp"
#include "host/base/dense.hpp"
#include "host/base/parallel.hpp"
#include "host/base/wide.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Pixels that are worked on together.
constexpr Index block_pixels = 1024;
/// Groups of views with a sum of their own: sums do not depend on the number of threads.
constexpr std::size_t groups = 8;

/// Calls work(first, size) for all blocks of pixels.
template <class Work>
void for_pixels(Index pixels, const Work& work) {
    for (Index first = 0; first < pixels; first += block_pixels)
        work(first, std::min(block_pixels, pixels - first));
}

/// sum += fᵀ f
BTFIELD_WIDE void add_moments(const double* f, std::size_t rows, std::size_t columns, double* sum) {
    for (std::size_t r = 0; r < rows; ++r, f += columns)
        for (std::size_t i = 0; i < columns; ++i) {
            const double factor = f[i];
            double* const to = sum + i * columns;
            for (std::size_t j = 0; j < columns; ++j) to[j] += factor * f[j];
        }
}

/// What least squares of a view needs: of pixels that count, S T = F and B.
struct ViewMoments {
    RowMajorMatrix ff, bf;  ///< Fᵀ F, Bᵀ F, about the means
    VectorXd f_mean, b_mean;
    double energy = 0.0;  ///< Σ |B − b|²
};

class JointSolver {
  public:
    JointSolver(const RelievedSurface& surface, const std::vector<JointView>& views,
                const JointOptions& options)
        : views_(&views), options_(options), pixels_(static_cast<Index>(area(surface.size()))) {
        for (const JointView& view : views)
            gathers_.emplace_back(surface.rays(view.direction), options.periodic);
    }
    [[nodiscard]] RowMajorMatrix start() const;
    /// The weights C of all views for these planes, B ≈ b + C (F − f); share of the variance that is left.
    double solve_weights(const RowMajorMatrix& planes);
    void improve(RowMajorMatrix& planes) const;
    [[nodiscard]] JointPlanes result(RowMajorMatrix planes, double unexplained) const;

  private:
    [[nodiscard]] ViewMoments moments(std::size_t view, const RowMajorMatrix& planes) const;
    [[nodiscard]] RowMajorMatrix pulled(const RowMajorMatrix& planes) const;
    [[nodiscard]] RowMajorMatrix target(Index planes) const;
    /// Σ over views of what work(view, sum) adds to a sum.
    template <class Work>
    [[nodiscard]] RowMajorMatrix sum_over_views(Index planes, const Work& work) const;

    const std::vector<JointView>* views_;
    JointOptions options_;
    Index pixels_;
    std::vector<SurfaceGather> gathers_;
    std::vector<ViewMoments> moments_;
    std::vector<RowMajorMatrix> weights_;  ///< C, [column of A][plane]
};

/// The leading planes of the view nearest to above that has as many as are asked for, else of the richest.
RowMajorMatrix JointSolver::start() const {
    const auto asked = static_cast<std::size_t>(options_.planes);
    const auto worse = [&](const JointView& a, const JointView& b) {
        const std::size_t of_a = std::min(a.reduced.rank(), asked), of_b = std::min(b.reduced.rank(), asked);
        return of_a != of_b ? of_a < of_b : a.direction[2] < b.direction[2];
    };
    const JointView& first = *std::ranges::max_element(*views_, worse);
    RowMajorMatrix all(pixels_, static_cast<Index>(first.reduced.rank()));
    first.reduced.take(0, all);
    return all.leftCols(std::min<Index>(options_.planes, all.cols()));
}

ViewMoments JointSolver::moments(std::size_t view, const RowMajorMatrix& planes) const {
    const ReducedView& reduced = (*views_)[view].reduced;
    const SurfaceGather& gather = gathers_[view];
    const Index m = planes.cols(), r = static_cast<Index>(reduced.rank());
    ViewMoments sums{RowMajorMatrix::Zero(m, m), RowMajorMatrix::Zero(r, m), VectorXd::Zero(m),
                     VectorXd::Zero(r), 0.0};
    RowMajorMatrix f, b, across;
    for_pixels(pixels_, [&](Index first, Index size) {
        f.resize(size, m);
        b.resize(size, r);
        gather.gather(planes, static_cast<std::size_t>(first), f);
        reduced.take(static_cast<std::size_t>(first), b);
        for (Index i = 0; i < size; ++i)
            if (!gather.counts(static_cast<std::size_t>(first + i))) b.row(i).setZero();
        add_moments(f.data(), static_cast<std::size_t>(size), static_cast<std::size_t>(m), sums.ff.data());
        across = b.transpose();
        add_product(across, f, sums.bf);
        sums.f_mean += f.colwise().sum().transpose();
        sums.b_mean += b.colwise().sum().transpose();
        sums.energy += b.squaredNorm();
    });
    const double count = std::max<double>(1.0, static_cast<double>(gather.count()));
    sums.f_mean /= count;
    sums.b_mean /= count;
    sums.ff -= count * sums.f_mean * sums.f_mean.transpose();
    sums.bf -= count * sums.b_mean * sums.f_mean.transpose();
    sums.energy -= count * sums.b_mean.squaredNorm();
    return sums;
}

double JointSolver::solve_weights(const RowMajorMatrix& planes) {
    const std::size_t views = views_->size();
    moments_.resize(views);
    weights_.resize(views);
    std::vector<double> left(views), energy(views);
    for_each_block(static_cast<int>(views), [&](int block) {
        const auto v = static_cast<std::size_t>(block);
        moments_[v] = moments(v, planes);
        const ViewMoments& of = moments_[v];
        // A view that sees little of a plane tells little of its weight.
        MatrixXd normal = of.ff;
        normal.diagonal().array() += 1e-9 * (normal.trace() / static_cast<double>(normal.rows()) + 1e-300);
        const Eigen::LLT<MatrixXd> factor(normal);
        const MatrixXd solved = factor.solve(MatrixXd(of.bf.transpose()));
        weights_[v] = solved.transpose();
        const double explained = 2.0 * weights_[v].cwiseProduct(of.bf).sum() -
                                 (weights_[v] * of.ff).cwiseProduct(weights_[v]).sum();
        const ReducedView& reduced = (*views_)[v].reduced;
        const double counted = static_cast<double>(gathers_[v].count()) / static_cast<double>(pixels_);
        energy[v] = of.energy + reduced.lost * counted;
        left[v] = energy[v] - explained;
    });
    double all = 0.0, rest = 0.0;
    for (std::size_t v = 0; v < views; ++v) {
        all += energy[v];
        rest += left[v];
    }
    return all > 0.0 ? rest / all : 0.0;
}

template <class Work>
RowMajorMatrix JointSolver::sum_over_views(Index planes, const Work& work) const {
    std::vector<RowMajorMatrix> sums(std::min(groups, views_->size()));
    for_each_block(static_cast<int>(sums.size()), [&](int group) {
        RowMajorMatrix& sum = sums[static_cast<std::size_t>(group)];
        sum.setZero(pixels_, planes);
        for (auto view = static_cast<std::size_t>(group); view < views_->size(); view += sums.size())
            work(view, sum);
    });
    for (std::size_t i = 1; i < sums.size(); ++i) sums[0] += sums[i];
    return std::move(sums[0]);
}

/// Σ Sᵀ (B − b)ᵀ C
RowMajorMatrix JointSolver::target(Index planes) const {
    return sum_over_views(planes, [&](std::size_t view, RowMajorMatrix& sum) {
        const ReducedView& reduced = (*views_)[view].reduced;
        RowMajorMatrix b, picture;
        for_pixels(pixels_, [&](Index first, Index size) {
            b.resize(size, static_cast<Index>(reduced.rank()));
            reduced.take(static_cast<std::size_t>(first), b);
            b.rowwise() -= moments_[view].b_mean.transpose();
            picture.setZero(size, planes);
            add_product(b, weights_[view], picture);
            gathers_[view].scatter(picture, static_cast<std::size_t>(first), sum);
        });
    });
}

/// Σ Sᵀ (S T − mean) Cᵀ C
RowMajorMatrix JointSolver::pulled(const RowMajorMatrix& planes) const {
    const Index m = planes.cols();
    return sum_over_views(m, [&](std::size_t view, RowMajorMatrix& sum) {
        const SurfaceGather& gather = gathers_[view];
        RowMajorMatrix f(pixels_, m);
        gather.gather(planes, 0, f);
        const Eigen::RowVectorXd mean =
            f.colwise().sum() / std::max<double>(1.0, static_cast<double>(gather.count()));
        const RowMajorMatrix square = weights_[view].transpose() * weights_[view];
        RowMajorMatrix picture;
        for_pixels(pixels_, [&](Index first, Index size) {
            f.middleRows(first, size).rowwise() -= mean;
            picture.setZero(size, m);
            add_product(f.middleRows(first, size), square, picture);
            gather.scatter(picture, static_cast<std::size_t>(first), sum);
        });
    });
}

void JointSolver::improve(RowMajorMatrix& planes) const {
    const Index m = planes.cols();
    MatrixXd square = MatrixXd::Zero(m, m);
    for (const RowMajorMatrix& c : weights_) square += c.transpose() * c;
    square.diagonal().array() += 1e-9 * square.trace() / static_cast<double>(m);
    // Planes act on each other where they are; places hardly do.
    const Eigen::LLT<MatrixXd> factor(square);
    const RowMajorMatrix inverse = factor.solve(MatrixXd::Identity(m, m));
    const auto conditioned = [&](const RowMajorMatrix& r) {
        RowMajorMatrix result = RowMajorMatrix::Zero(r.rows(), m);
        add_product(r, inverse, result);
        return result;
    };
    RowMajorMatrix residual = target(m) - pulled(planes);
    RowMajorMatrix solved = conditioned(residual), direction = solved;
    double product = residual.cwiseProduct(solved).sum();
    for (int step = 0; step < options_.steps && product > 0.0; ++step) {
        const RowMajorMatrix image = pulled(direction);
        const double curvature = direction.cwiseProduct(image).sum();
        if (!(curvature > 0.0)) break;
        const double length = product / curvature;
        planes += length * direction;
        residual -= length * image;
        solved = conditioned(residual);
        const double next = residual.cwiseProduct(solved).sum();
        direction = solved + (next / product) * direction;
        product = next;
    }
}

/// cov T = I and Σ Uᵀ U diagonal, descending.
JointPlanes JointSolver::result(RowMajorMatrix planes, double unexplained) const {
    const Index m = planes.cols();
    const Eigen::RowVectorXd mean = planes.colwise().mean();
    planes.rowwise() -= mean;
    MatrixXd covariance = planes.transpose() * planes / static_cast<double>(pixels_);
    covariance.diagonal().array() += 1e-12 * covariance.trace() / static_cast<double>(m);
    const Eigen::LLT<MatrixXd> root(covariance);
    const MatrixXd lower = root.matrixL();
    MatrixXd square = MatrixXd::Zero(m, m);
    for (const RowMajorMatrix& c : weights_) square += c.transpose() * c;
    const MatrixXd energy = lower.transpose() * square * lower;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(energy);
    const MatrixXd turn = solver.eigenvectors().rowwise().reverse();
    // T L⁻ᵀ V, and U L V beside it.
    const MatrixXd forward = root.matrixU().solve(turn), back = lower * turn;

    JointPlanes result;
    result.unexplained = unexplained;
    for (std::size_t v = 0; v < views_->size(); ++v) {
        const ReducedView& reduced = (*views_)[v].reduced;
        result.weights.emplace_back(reduced.basis * (weights_[v] * back));
        const VectorXd shift =
            reduced.basis * (moments_[v].b_mean - weights_[v] * (moments_[v].f_mean - mean.transpose()));
        std::vector<double> offsets = reduced.offset;
        for (std::size_t row = 0; row < offsets.size(); ++row) offsets[row] += shift[static_cast<Index>(row)];
        result.offsets.push_back(std::move(offsets));
    }
    result.planes = planes * forward;
    return result;
}

}  // namespace

double joint_planes_bytes(std::size_t pixels, std::size_t views, int planes, int rank) {
    const std::size_t sums = std::min(groups, views);
    const std::size_t threads = std::min(sums, static_cast<std::size_t>(thread_limit()));
    // Beside sums, and planes as each thread sees them: T and what conjugate gradients keep and pass on.
    constexpr std::size_t kept = 7;
    const auto matrices = static_cast<double>(sums + threads + kept) * planes;
    const double first = static_cast<double>(rank) + planes;  // of start()
    return static_cast<double>(pixels) * (std::max(matrices, first) * sizeof(double) +
                                          static_cast<double>(views * SurfaceGather::bytes_of_pixel()));
}

JointPlanes fit_joint_planes(const RelievedSurface& surface, const std::vector<JointView>& views,
                             const JointOptions& options) {
    JointSolver solver(surface, views, options);
    RowMajorMatrix planes = solver.start();
    double unexplained = solver.solve_weights(planes);
    for (int pass = 0; pass < options.passes; ++pass) {
        solver.improve(planes);
        unexplained = solver.solve_weights(planes);
        if (options.progress) options.progress((pass + 1.0) / options.passes);
    }
    return solver.result(std::move(planes), unexplained);
}

}  // namespace btfield::detail
