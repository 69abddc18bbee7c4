#include "btfield/spectral_basis.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "btfield/error.hpp"
#include "host/analysis/lag_products.hpp"
#include "host/analysis/plane_kinds.hpp"
#include "host/base/dense.hpp"
#include "host/base/parallel.hpp"
#include "host/base/text.hpp"

namespace btfield {

using namespace detail;

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using std::size_t;

/// Pixels that a thread takes at a time: its sums of all planes stay in the first cache.
constexpr size_t block_pixels = 1024;

Eigen::Map<const RowMajorMatrix> matrix_of(const SpectralBasis& basis) {
    return {basis.matrix.data(), basis.rank, basis.planes};
}

/// T D⁻¹
MatrixXd forward(const SpectralBasis& basis) {
    MatrixXd t = matrix_of(basis);
    for (size_t j = 0; j < basis.scale.size(); ++j) t.col(static_cast<Index>(j)) /= basis.scale[j];
    return t;
}

/// D Tᵀ
MatrixXd back(const SpectralBasis& basis) {
    MatrixXd t = matrix_of(basis).transpose();
    for (size_t j = 0; j < basis.scale.size(); ++j) t.row(static_cast<Index>(j)) *= basis.scale[j];
    return t;
}

/// What both kinds of bases begin with; rows of T are still to come.
struct Moments {
    SpectralBasis basis;
    MatrixXd covariance;  ///< D⁻¹ Σ_Y D⁻¹
};

/// \throws InputError when the picture is empty, constant, or holds a NaN or infinity
Moments moments_of(const Image& image) {
    const std::array<Offset, 1> zero = {Offset{}};
    std::vector<double> covariance = covariances_at(image, zero);
    const std::string asked = "find the spectral basis of a picture";
    if (!std::ranges::all_of(covariance, [](double c) { return std::isfinite(c); }))
        throw InputError(asked, "it holds values that are not finite", "replace NaN and infinite pixels");
    const auto d = static_cast<size_t>(image.planes());
    Moments result;
    result.basis.planes = image.planes();
    result.basis.mean = plane_means(image);
    std::vector<double> variances;
    bool varies = false;
    for (size_t p = 0; p < d; ++p) {
        // Rounding of a mean may give a constant plane a variance of its value's 1e-33.
        const double m = result.basis.mean[p], variance = covariance[p * d + p];
        variances.push_back(variance > 1e-28 * m * m ? variance : 0.0);
        varies = varies || variances.back() > 0.0;
    }
    if (!varies) throw InputError(asked, "all its pixels are equal", "give a picture that varies");
    result.basis.scale = kind_deviations(image, variances);
    result.covariance = Eigen::Map<const RowMajorMatrix>(covariance.data(), image.planes(), image.planes());
    for (size_t p = 0; p < d; ++p) {
        const auto i = static_cast<Index>(p);
        if (!(variances[p] > 0.0)) {
            result.covariance.row(i).setZero();
            result.covariance.col(i).setZero();
        } else if (!result.basis.scale.empty()) {
            result.covariance.row(i) /= result.basis.scale[p];
            result.covariance.col(i) /= result.basis.scale[p];
        }
    }
    return result;
}

void require_planes(const char* asked, int found, int expected) {
    if (found == expected) return;
    throw InputError(
        asked, "there are " + counted(found, "plane") + " where the basis has " + std::to_string(expected),
        "use the basis of this very picture");
}

/// Signs are arbitrary in a decomposition: the largest component decides, the first of those that rounding
/// cannot tell apart.
template <class Row>
void fix_sign(Row row) {
    const double most = row.cwiseAbs().maxCoeff();
    for (Index j = 0; j < row.size(); ++j) {
        if (std::abs(row(j)) < most * (1.0 - 1e-9)) continue;
        if (row(j) < 0.0) row = -row;
        return;
    }
}

/// target_i = after_i + Σ_j weights(i, j) (source_j − before_j), pixel by pixel.
void combine(const Image& source, Image& target, const MatrixXd& weights, const std::vector<double>& before,
             const std::vector<double>& after) {
    const size_t pixels = area(source.size());
    const auto blocks = static_cast<int>((pixels + block_pixels - 1) / block_pixels);
    for_each_block(blocks, [&](int block) {
        const size_t first = static_cast<size_t>(block) * block_pixels;
        const size_t count = std::min(block_pixels, pixels - first);
        std::array<double, block_pixels> sums;
        for (int i = 0; i < target.planes(); ++i) {
            std::fill_n(sums.begin(), count, after[static_cast<size_t>(i)]);
            for (int j = 0; j < source.planes(); ++j) {
                const double weight = weights(i, j), centre = before[static_cast<size_t>(j)];
                const float* values = source.plane(j).data() + first;
                for (size_t n = 0; n < count; ++n)
                    sums[n] += weight * (static_cast<double>(values[n]) - centre);
            }
            float* out = target.plane(i).data() + first;
            for (size_t n = 0; n < count; ++n) out[n] = static_cast<float>(sums[n]);
        }
    });
}

}  // namespace

SpectralBasis spectral_basis(const Image& image) {
    auto [basis, covariance] = moments_of(image);
    const Index d = image.planes();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(covariance);
    const double most = solver.eigenvalues()(d - 1);
    for (Index k = d - 1; k >= 0 && solver.eigenvalues()(k) > smallest_relative_variance * most; --k) {
        Eigen::RowVectorXd row = solver.eigenvectors().col(k).transpose();
        fix_sign(Eigen::Ref<Eigen::RowVectorXd>(row));
        basis.matrix.insert(basis.matrix.end(), row.data(), row.data() + d);
        ++basis.rank;
    }
    return basis;
}

SpectralBasis varying_planes(const Image& image) {
    auto [basis, covariance] = moments_of(image);
    const double most = covariance.diagonal().maxCoeff();
    for (int p = 0; p < image.planes(); ++p) {
        if (!(covariance(p, p) > smallest_relative_variance * most)) continue;
        for (int q = 0; q < image.planes(); ++q) basis.matrix.push_back(q == p ? 1.0 : 0.0);
        ++basis.rank;
    }
    return basis.rank < basis.planes || !basis.scale.empty() ? basis : SpectralBasis{};
}

Image to_eigenplanes(const SpectralBasis& basis, const Image& image) {
    require_planes("turn a picture into eigenplanes", image.planes(), basis.planes);
    Image result(image.size(), basis.rank);
    combine(image, result, forward(basis), basis.mean,
            std::vector<double>(static_cast<size_t>(basis.rank), 0.0));
    return result;
}

Image from_eigenplanes(const SpectralBasis& basis, const Image& eigenplanes, ColourSpace space) {
    require_planes("turn eigenplanes into a picture", eigenplanes.planes(), basis.rank);
    Image result(eigenplanes.size(), basis.planes, space);
    combine(eigenplanes, result, back(basis), std::vector<double>(static_cast<size_t>(basis.rank), 0.0),
            basis.mean);
    return result;
}

LagCovariance turned(const SpectralBasis& basis, const LagCovariance& statistic) {
    require_planes("turn lag covariances", statistic.planes(), basis.planes);
    const MatrixXd t = forward(basis);
    LagCovariance result(basis.rank, statistic.size(), statistic.box());
    const Eigen::Map<const Eigen::VectorXd> means(statistic.mean().data(), basis.planes),
        centre(basis.mean.data(), basis.planes);
    Eigen::Map<Eigen::VectorXd>(result.mean().data(), basis.rank) = t * (means - centre);
    MatrixXd block(basis.planes, basis.planes);
    for (int row = 0; row <= statistic.box().row; ++row) {
        for (int column = row == 0 ? 0 : -statistic.box().column; column <= statistic.box().column;
             ++column) {
            const Offset s{row, column};
            for (int i = 0; i < basis.planes; ++i)
                for (int j = 0; j < basis.planes; ++j) block(i, j) = statistic(i, j, s);
            const MatrixXd seen = congruent(t, block);
            for (int i = 0; i < basis.rank; ++i)
                for (int j = 0; j < basis.rank; ++j) result.set(i, j, s, seen(i, j));
        }
    }
    return result;
}

std::vector<double> turned_back(const SpectralBasis& basis, std::span<const double> covariances) {
    const auto r = static_cast<size_t>(basis.rank), d = static_cast<size_t>(basis.planes);
    if (covariances.size() % (r * r) != 0)
        throw InputError("turn covariances of " + counted(r, "eigenplane") + " back",
                         "their number is " + std::to_string(covariances.size()),
                         "give " + std::to_string(r * r) + " of each lag");
    const MatrixXd t = back(basis);
    const size_t lags = covariances.size() / (r * r);
    std::vector<double> result(lags * d * d);
    for (size_t s = 0; s < lags; ++s) {
        const Eigen::Map<const RowMajorMatrix> block(covariances.data() + s * r * r, basis.rank, basis.rank);
        Eigen::Map<RowMajorMatrix>(result.data() + s * d * d, basis.planes, basis.planes) =
            congruent(t, block);
    }
    return result;
}

void check(const SpectralBasis& basis) {
    const std::string asked = "use a spectral basis";
    const auto refuse = [&](const std::string& found) {
        throw InputError(asked, found, "fit the model anew");
    };
    if (basis.planes < 1 || basis.rank < 1 || basis.rank > basis.planes)
        refuse("it has " + counted(basis.rank, "eigenplane") + " of " + counted(basis.planes, "plane"));
    const auto r = static_cast<size_t>(basis.rank), d = static_cast<size_t>(basis.planes);
    if (basis.matrix.size() != r * d || basis.mean.size() != d)
        refuse("its matrix has " + std::to_string(basis.matrix.size()) + " entries and its mean " +
               std::to_string(basis.mean.size()) + ", not " + std::to_string(r * d) + " and " +
               std::to_string(d));
    const auto finite = [](double value) { return std::isfinite(value); };
    if (!std::ranges::all_of(basis.mean, finite) || !std::ranges::all_of(basis.matrix, finite))
        refuse("it holds values that are not finite");
    if (!basis.scale.empty() && (basis.scale.size() != d || !std::ranges::all_of(basis.scale, [](double s) {
                                     return std::isfinite(s) && s > 0.0;
                                 })))
        refuse("its scale is not " + std::to_string(d) + " positive numbers");
    const Eigen::Map<const RowMajorMatrix> t = matrix_of(basis);
    const double off = (t * t.transpose() - MatrixXd::Identity(basis.rank, basis.rank)).cwiseAbs().maxCoeff();
    if (!(off <= 1e-9)) refuse("its rows are not orthonormal");
}

}  // namespace btfield
