#include "host/fit/model_density.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

#include "btfield/theory.hpp"
#include "host/analysis/expansion.hpp"
#include "host/base/dense.hpp"
#include "host/base/parallel.hpp"
#include "host/spectrum/local_lambda.hpp"
#include "host/spectrum/spectral_density.hpp"
#include "host/spectrum/spectral_form.hpp"

namespace btfield::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using std::size_t;

/// S_t of one model at any frequency.
class PartDensity {
  public:
    explicit PartDensity(const Model& model) : form_(model), lambda_(form_.lambda) {
        const MatrixXd noise = noise_matrix(form_.lambda);
        switch (form_.kind) {
            case SpectralForm::Kind::autoregressive:
                noise_ = MatrixXd(noise.llt().matrixL()).cast<std::complex<double>>();
                break;
            case SpectralForm::Kind::moving_average:
                noise_ = symmetric_root(noise).cast<std::complex<double>>();
                break;
            case SpectralForm::Kind::pmrf:
                left_ = form_.left.cast<std::complex<double>>();
                right_ = form_.right.cast<std::complex<double>>();
                break;
            case SpectralForm::Kind::mmrf:
                noise_ = noise.cast<std::complex<double>>();
                break;
        }
    }
    [[nodiscard]] Index planes() const { return form_.planes(); }
    [[nodiscard]] MatrixXcd at(double row_frequency, double column_frequency) const {
        const MatrixXcd lambda = lambda_.at(row_frequency, column_frequency);
        if (form_.kind == SpectralForm::Kind::moving_average) {
            const MatrixXcd coloured = product(lambda, noise_);
            return product(coloured, coloured.adjoint());
        }
        const MatrixXcd inverse = lambda.inverse();
        if (form_.kind == SpectralForm::Kind::mmrf) return product(inverse, noise_);
        if (form_.kind == SpectralForm::Kind::pmrf)
            return product(product(product(product(inverse, left_), lambda), right_), inverse.adjoint());
        const MatrixXcd coloured = product(inverse, noise_);
        return product(coloured, coloured.adjoint());
    }

  private:
    SpectralForm form_;
    LocalLambda<Eigen::Dynamic> lambda_;
    MatrixXcd noise_, left_, right_;
};

/// E² at each frequency; E is real, as the kernel is its own mirror image.
std::vector<double> squared_transform(const std::vector<double>& kernel,
                                      const std::vector<double>& frequencies) {
    const auto centre = static_cast<int>(kernel.size() / 2);
    std::vector<double> squares;
    for (const double frequency : frequencies) {
        double sum = 0.0;
        for (size_t u = 0; u < kernel.size(); ++u)
            sum += kernel[u] * std::cos(frequency * (static_cast<int>(u) - centre));
        squares.push_back(sum * sum);
    }
    return squares;
}

struct LevelDensity {
    double step = 1.0;  ///< n^k
    double scale = 1.0;
    std::vector<double> rows, columns;  ///< E²
    std::vector<PartDensity> parts;

    /// Adds the level's share of S at node (m, n).
    void add(const FrequencyGrid& grid, size_t m, size_t n, MatrixXcd& sum) const {
        const double weight = scale * rows[m] * columns[n];
        if (!(weight > 0.0)) return;
        Index first = 0;
        for (const PartDensity& part : parts) {
            const Index d = part.planes();
            sum.block(first, first, d, d) += weight * part.at(step * grid.row[m], step * grid.column[n]);
            first += d;
        }
    }
};

std::vector<LevelDensity> level_densities(const TextureModel& model, const FrequencyGrid& grid) {
    std::vector<LevelDensity> levels;
    for (size_t k = 0; k < model.levels.size(); ++k) {
        const LevelModel& level = model.levels[k];
        const std::vector<double> kernel = composed_expand_kernel(model.factor, static_cast<int>(k));
        LevelDensity density;
        density.step = std::pow(model.factor, static_cast<double>(k));
        density.scale = level.gain * level.gain / (density.step * density.step);
        density.rows = squared_transform(kernel, grid.row);
        density.columns = squared_transform(kernel, grid.column);
        for (const Model& part : level.models) density.parts.emplace_back(part);
        levels.push_back(std::move(density));
    }
    return levels;
}

MatrixXd whitening_of(const TextureModel& model) {
    const Index d = modelled_planes(model);
    if (model.whitening.empty()) return MatrixXd::Identity(d, d);
    return Eigen::Map<const RowMajorMatrix>(model.whitening.data(), d, d);
}

}  // namespace

double picture_log_likelihood(const TextureModel& model, const FoldedPeriodogram& periodogram) {
    const FrequencyGrid& grid = periodogram.grid;
    const std::vector<LevelDensity> levels = level_densities(model, grid);
    const Index d = modelled_planes(model);
    const MatrixXcd whitening = whitening_of(model).cast<std::complex<double>>();
    std::vector<double> sums(grid.row.size());
    for_each_block(static_cast<int>(grid.row.size()), [&](int block) {
        const auto m = static_cast<size_t>(block);
        MatrixXcd density(d, d), cell(d, d);
        for (size_t n = 0; n < grid.column.size(); ++n) {
            if (grid.row[m] == 0.0 && grid.column[n] == 0.0) continue;
            density.setZero();
            for (const LevelDensity& level : levels) level.add(grid, m, n, density);
            density = product(product(whitening, density), whitening.adjoint());
            for (Index i = 0; i < d; ++i) {
                for (Index j = 0; j < d; ++j) {
                    const auto a = static_cast<int>(i), b = static_cast<int>(j);
                    cell(i, j) = {periodogram.rows[m].real(a, b)[n], periodogram.rows[m].imaginary(a, b)[n]};
                }
            }
            const MatrixXcd hermitian = 0.5 * (density + density.adjoint());
            const Eigen::LLT<MatrixXcd> root(hermitian);
            const MatrixXcd lower = root.matrixL();
            const double term =
                root.info() == Eigen::Success
                    ? 2.0 * lower.diagonal().real().array().log().sum() + root.solve(cell).trace().real()
                    : std::numeric_limits<double>::quiet_NaN();
            const double constant = static_cast<double>(d) * std::log(2.0 * std::numbers::pi);
            sums[m] += grid.row_weight[m] * grid.column_weight[n] * (constant + term);
        }
    });
    double sum = 0.0;
    for (const double row : sums) sum += row;
    return std::isfinite(sum) ? -0.5 * sum : std::numeric_limits<double>::quiet_NaN();
}

double lag_covariance_error(const TextureModel& model, const std::vector<Offset>& lags,
                            const std::vector<double>& data) {
    const std::vector<double> modelled = theoretical_covariance(model, model.size, lags);
    const auto d = static_cast<size_t>(model.planes), block = d * d;
    double error = 0.0;
    for (size_t s = 0; s < lags.size(); ++s) {
        for (size_t i = 0; i < d; ++i) {
            const size_t place = i * d + i;
            if (!(data[place] > 0.0)) continue;  // a constant plane
            error += std::abs(data[s * block + place] - modelled[s * block + place]) / data[place];
        }
    }
    return error / static_cast<double>(lags.size() * d);
}

}  // namespace btfield::detail
