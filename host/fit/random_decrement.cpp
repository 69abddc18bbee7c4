#include "host/fit/random_decrement.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <span>
#include <string>

#include "btfield/error.hpp"
#include "host/analysis/lag_matrices.hpp"
#include "host/base/decompositions.hpp"
#include "host/base/dense.hpp"
#include "host/base/non_negative.hpp"
#include "host/base/parallel.hpp"
#include "host/base/text.hpp"
#include "host/fit/least_squares.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::size_t;

int wrapped(int value, int side) {
    const int rest = value % side;
    return rest < 0 ? rest + side : rest;
}

std::string describe(const Image& level) {
    return "random decrement of a level of " + text_of(level.size());
}

/// Sums over the significant pixels of some rows, [s][i][j].
struct Sums {
    std::vector<double> sums, counts;
};

/// Walks over rows of the level.
class Collector {
  public:
    Collector(const Image& level, std::span<const std::uint8_t> inside, const std::vector<float>& thresholds,
              const std::vector<Offset>& offsets, SignificanceRule rule)
        : level_(&level),
          inside_(inside),
          thresholds_(&thresholds),
          offsets_(&offsets),
          rule_(rule),
          width_(static_cast<size_t>(level.width())),
          above_(static_cast<size_t>(level.planes()) * width_),
          beside_(above_.size()) {}

    void add_row(int r, Sums& part) {
        const int d = level_->planes();
        for (int i = 0; i < d; ++i) judge(i, r);
        for (int j = 0; j < d; ++j) {
            for (int i = 0; i < d; ++i) {
                find(i, j, r);
                for (size_t s = 0; s < offsets_->size(); ++s) {
                    const size_t at =
                        (s * static_cast<size_t>(d) + static_cast<size_t>(i)) * static_cast<size_t>(d) +
                        static_cast<size_t>(j);
                    add_at(i, r, (*offsets_)[s], part.sums[at], part.counts[at]);
                }
            }
        }
    }

  private:
    [[nodiscard]] const float* row(int plane, int r) const {
        return level_->plane(plane).data() + static_cast<size_t>(wrapped(r, level_->height())) * width_;
    }

    /// Where the plane is above its threshold, and where its neighbours are below as the rule says.
    void judge(int plane, int r) {
        const float xi = (*thresholds_)[static_cast<size_t>(plane)];
        const float *here = row(plane, r), *north = row(plane, r - 1), *south = row(plane, r + 1);
        std::uint8_t* above = above_.data() + static_cast<size_t>(plane) * width_;
        std::uint8_t* beside = beside_.data() + static_cast<size_t>(plane) * width_;
        const bool both = rule_ == SignificanceRule::p4;
        const auto pixel = [&](size_t c, float west, float east) {
            const bool along = (west < xi) | (east < xi), across = (north[c] < xi) | (south[c] < xi);
            above[c] = static_cast<std::uint8_t>(here[c] > xi);
            beside[c] = static_cast<std::uint8_t>(both ? along & across : along | across);
        };
        pixel(0, here[width_ - 1], here[width_ > 1 ? 1 : 0]);
        for (size_t c = 1; c + 1 < width_; ++c) pixel(c, here[c - 1], here[c + 1]);
        if (width_ > 1) pixel(width_ - 1, here[width_ - 2], here[0]);
    }

    /// Whether each pixel of the row counts; null where all do.
    [[nodiscard]] const std::uint8_t* inside(int r) const {
        return inside_.empty() ? nullptr
                               : inside_.data() + static_cast<size_t>(wrapped(r, level_->height())) * width_;
    }

    void find(int i, int j, int r) {
        const std::uint8_t* above = above_.data() + static_cast<size_t>(j) * width_;
        const std::uint8_t* beside = beside_.data() + static_cast<size_t>(i) * width_;
        const std::uint8_t* counted = inside(r);
        found_.clear();
        for (size_t c = 0; c < width_; ++c) {
            if ((above[c] & beside[c]) != 0 && (counted == nullptr || counted[c] != 0)) found_.push_back(c);
        }
    }

    void add_at(int plane, int r, Offset s, double& sum, double& count) const {
        const float* source = row(plane, r + s.row);
        const std::uint8_t* counted = inside(r + s.row);
        const auto shift = static_cast<size_t>(wrapped(s.column, level_->width()));
        for (const size_t c : found_) {
            const size_t at = c + shift < width_ ? c + shift : c + shift - width_;
            if (counted != nullptr && counted[at] == 0) continue;
            sum += static_cast<double>(source[at]);
            count += 1.0;
        }
    }

    const Image* level_;
    std::span<const std::uint8_t> inside_;
    const std::vector<float>* thresholds_;
    const std::vector<Offset>* offsets_;
    SignificanceRule rule_;
    size_t width_;
    std::vector<std::uint8_t> above_, beside_;  ///< [plane][column]
    std::vector<size_t> found_;
};

std::vector<float> thresholds_of(const Image& level, const LagCovariance& statistic,
                                 const MaOptions& options) {
    if (level.planes() < 1 || level.planes() != statistic.planes() || !(level.size() == statistic.size())) {
        throw InputError(describe(level), "the lag covariances belong to another picture",
                         "compute them from the same level");
    }
    if (!std::isfinite(options.threshold)) {
        throw InputError(describe(level), "the threshold xi is not finite", "give a number such as 0.5");
    }
    std::vector<float> thresholds;
    for (int i = 0; i < level.planes(); ++i) {
        const double variance = statistic(i, i, {});
        if (!(variance > 0.0) || !std::isfinite(variance)) {
            throw InputError(describe(level), "plane " + std::to_string(i + 1) + " is constant",
                             "remove that plane or use a picture that varies");
        }
        thresholds.push_back(static_cast<float>(statistic.mean()[static_cast<size_t>(i)] +
                                                options.threshold * std::sqrt(variance)));
    }
    return thresholds;
}

/// Covariance at lag 0 of the moving average.
MatrixXd variance_of(const std::vector<MatrixXd>& a, const MatrixXd& noise) {
    MatrixXd sum = MatrixXd::Zero(noise.rows(), noise.cols());
    for (const MatrixXd& block : a) sum += congruent(block, noise);
    return sum;
}

/// A_s, s = 0, 1, …, where every plane's deviation is `deviation`, in planes of unit deviation.
std::vector<MatrixXd> scaled(const std::vector<MatrixXd>& a, const VectorXd& deviation) {
    std::vector<MatrixXd> blocks;
    blocks.reserve(a.size());
    for (const MatrixXd& block : a)
        blocks.emplace_back(deviation.cwiseInverse().asDiagonal() * block * deviation.asDiagonal());
    return blocks;
}

/// Variances of uncorrelated noise that give all planes variance 1 through the moving average; where that
/// takes a negative one, those that come nearest to it without. A plane whose own noise is not wanted, as the
/// others' explain more than it varies, keeps a millionth of the largest: noise varies in every plane.
VectorXd noise_variances(const std::vector<MatrixXd>& b) {
    const Index d = b.front().rows();
    MatrixXd system = MatrixXd::Zero(d, d);
    for (const MatrixXd& block : b) system += block.cwiseAbs2();
    const VectorXd one = VectorXd::Ones(d);
    VectorXd variances = least_norm_solution(system, one, 1e-10);
    constexpr double least = 1e-6;
    if (!(variances.minCoeff() > 0.0)) variances = non_negative_least_squares(system, one);
    return variances.cwiseMax(least * variances.maxCoeff());
}

/// Full Σ_e of Σ_s B_s Σ_e B_sᵀ = C, least squares of least norm where the equations do not determine it,
/// its negative eigenvalues set to 0.
MatrixXd full_noise(const std::vector<MatrixXd>& b, const MatrixXd& correlation) {
    const Index d = correlation.rows(), unknowns = d * (d + 1) / 2;
    MatrixXd system = MatrixXd::Zero(unknowns, unknowns);
    VectorXd right(unknowns);
    const auto for_entries = [&](const auto& visit) {
        Index at = 0;
        for (Index i = 0; i < d; ++i) {
            for (Index j = i; j < d; ++j) visit(at++, i, j);
        }
    };
    for (const MatrixXd& block : b) {
        for_entries([&](Index row, Index i, Index j) {
            for_entries([&](Index column, Index k, Index l) {
                system(row, column) += k == l ? block(i, k) * block(j, k)
                                              : block(i, k) * block(j, l) + block(i, l) * block(j, k);
            });
        });
    }
    for_entries([&](Index row, Index i, Index j) { right[row] = correlation(i, j); });
    const VectorXd solution = least_norm_solution(system, right, 1e-10);
    MatrixXd noise = MatrixXd::Zero(d, d);
    for_entries([&](Index at, Index i, Index j) { noise(i, j) = noise(j, i) = solution[at]; });
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(noise);
    if (eigen.eigenvalues().minCoeff() >= 0.0) return noise;
    const MatrixXd& vectors = eigen.eigenvectors();
    noise = vectors * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() * vectors.transpose();
    return 0.5 * (noise + noise.transpose());
}

/// Σ_e of Σ_s A_s Σ_e A_sᵀ = C(0) or what comes nearest to it. Planes are scaled to unit deviation, so that
/// their units do not matter.
MatrixXd solve_noise(const std::vector<MatrixXd>& a, const MatrixXd& target, NoiseForm form) {
    const VectorXd deviation = target.diagonal().cwiseSqrt();
    const std::vector<MatrixXd> b = scaled(a, deviation);
    MatrixXd noise;
    if (form == NoiseForm::full) {
        const VectorXd inverse = deviation.cwiseInverse();
        noise = full_noise(b, inverse.asDiagonal() * target * inverse.asDiagonal());
    }
    // Also where no full one is left.
    if (form == NoiseForm::diagonal || !(noise.diagonal().minCoeff() > 0.0))
        noise = noise_variances(b).asDiagonal();
    return deviation.asDiagonal() * noise * deviation.asDiagonal();
}

}  // namespace

std::vector<double> random_decrement(const Image& level, const LagCovariance& statistic,
                                     const std::vector<Offset>& offsets, const MaOptions& options,
                                     std::span<const std::uint8_t> inside) {
    const std::vector<float> thresholds = thresholds_of(level, statistic, options);
    const auto d = static_cast<size_t>(level.planes());
    constexpr int rows_per_block = 32;
    const int blocks = (level.height() + rows_per_block - 1) / rows_per_block;
    std::vector<Sums> parts(static_cast<size_t>(blocks));
    for_each_block(blocks, [&](int block) {
        Sums& part = parts[static_cast<size_t>(block)];
        part.sums.assign(offsets.size() * d * d, 0.0);
        part.counts.assign(offsets.size() * d * d, 0.0);
        Collector collector(level, inside, thresholds, offsets, options.rule);
        const int last = std::min(level.height(), (block + 1) * rows_per_block);
        for (int r = block * rows_per_block; r < last; ++r) collector.add_row(r, part);
    });
    std::vector<double> sums(offsets.size() * d * d, 0.0), counts(sums.size(), 0.0);
    for (const Sums& part : parts) {
        for (size_t k = 0; k < sums.size(); ++k) sums[k] += part.sums[k];
        for (size_t k = 0; k < counts.size(); ++k) counts[k] += part.counts[k];
    }
    for (size_t pair = 0; pair < d * d; ++pair) {
        double most = 0.0;  // neighbours inside: none at some offsets of a thin region
        for (size_t s = 0; s < offsets.size(); ++s) most = std::max(most, counts[s * d * d + pair]);
        if (!(most > 0.0)) {
            throw InputError(describe(level),
                             "no pixel of plane " + std::to_string(pair % d + 1) +
                                 " is significant: above xi = " + std::to_string(options.threshold) +
                                 " standard deviations with neighbours in plane " +
                                 std::to_string(pair / d + 1) + " below it",
                             "use a smaller xi, or fewer levels");
        }
        for (size_t s = 0; s < offsets.size(); ++s) {
            double& value = sums[s * d * d + pair];
            const double count = counts[s * d * d + pair];
            value = count > 0.0 ? value / count - statistic.mean()[pair / d] : 0.0;
        }
    }
    return sums;
}

MaModel fit_ma(const Image& level, const LagCovariance& statistic, const Support& support, NoiseForm noise,
               const MaOptions& options, std::span<const std::uint8_t> inside) {
    MaModel model;
    model.planes = level.planes();
    model.kind = support.kind;
    model.offsets = support.offsets;
    if (std::find(model.offsets.begin(), model.offsets.end(), Offset{}) == model.offsets.end())
        model.offsets.insert(std::upper_bound(model.offsets.begin(), model.offsets.end(), Offset{}),
                             Offset{});
    if (std::set<Offset>(model.offsets.begin(), model.offsets.end()).size() != model.offsets.size())
        throw InputError(describe(level), "the support repeats an offset", "list every offset once");
    model.coefficients = random_decrement(level, statistic, model.offsets, options, inside);

    const Index d = model.planes;
    std::vector<MatrixXd> a;
    for (size_t s = 0; s < model.offsets.size(); ++s) {
        a.emplace_back(Eigen::Map<const RowMajorMatrix>(
            model.coefficients.data() + static_cast<std::ptrdiff_t>(s) * d * d, d, d));
    }
    const MatrixXd target = lag_zero(statistic);
    const MatrixXd covariance = solve_noise(a, target, noise);
    // 1 wherever Σ_e solves the equations.
    const VectorXd variance = variance_of(a, covariance).diagonal();
    for (Index i = 0; i < d; ++i) {
        const double scale = std::sqrt(target(i, i) / variance[i]);
        if (!std::isfinite(scale))
            throw InputError(describe(level),
                             "no noise covariance gives plane " + std::to_string(i + 1) + " its variance",
                             "use another xi or significance rule");
        if (std::abs(scale - 1.0) <= 1e-9) continue;
        for (size_t k = 0; k < model.coefficients.size(); ++k) {
            if (static_cast<Index>(k) / d % d == i) model.coefficients[k] *= scale;
        }
    }
    for (Index i = 0; i < d; ++i) {
        for (Index j = 0; j < d; ++j)
            model.noise_covariance.push_back(covariance(std::min(i, j), std::max(i, j)));
    }
    return model;
}

}  // namespace btfield::detail
