#include "host/fit/likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "btfield/error.hpp"
#include "host/analysis/lag_matrices.hpp"
#include "host/base/eigen.hpp"
#include "host/base/parallel.hpp"
#include "host/fit/least_squares.hpp"
#include "host/spectrum/lattice.hpp"
#include "host/spectrum/spectral_density.hpp"
#include "host/spectrum/spectral_form.hpp"

namespace btfield::detail {
namespace {

using Eigen::MatrixXd;
using std::size_t;

/// mean_t tr(Σ⁻¹ Λ_t I_t) = tr(Σ⁻¹ (C(0) − Σ_s A_s E[y(r ⊕ s) y(r)ᵀ])).
double markov_quadratic(const LinearField& field, const LagCovariance& statistic,
                        const Eigen::LLT<MatrixXd>& noise) {
    const int d = field.planes;
    MatrixXd error = lag_zero(statistic);
    for (size_t s = 0; s < field.offsets.size(); ++s) {
        for (int i = 0; i < d; ++i) {
            for (int k = 0; k < d; ++k) {
                for (int j = 0; j < d; ++j) {
                    const auto place =
                        (s * static_cast<size_t>(d) + static_cast<size_t>(i)) * static_cast<size_t>(d) +
                        static_cast<size_t>(j);
                    error(i, k) -= field.coefficients[place] * statistic(k, j, field.offsets[s]);
                }
            }
        }
    }
    return noise.solve(error).trace();
}

/// The planes of a row of cells that a model of `planes` planes is of.
LaneMatrix cells_of(const LaneMatrix& row, int first_plane, int planes) {
    LaneMatrix cells(planes, row.lanes());
    for (int i = 0; i < planes; ++i) {
        for (int j = 0; j < planes; ++j)
            std::copy_n(row.real(first_plane + i, first_plane + j), 2 * row.lanes(), cells.real(i, j));
    }
    return cells;
}

/// mean_t tr(S_t⁻¹ I_t) over the cells of the periodogram.
double periodogram_quadratic(const SpectralForm& form, const FoldedPeriodogram& periodogram,
                             int first_plane) {
    const int d = form.planes();
    const bool pmrf = form.kind == SpectralForm::Kind::pmrf;
    const MatrixXd noise = noise_matrix(form.lambda).inverse();
    const MatrixXd left = pmrf ? MatrixXd(form.left.inverse()) : MatrixXd();
    const MatrixXd right = pmrf ? MatrixXd(form.right.inverse()) : MatrixXd();
    const FrequencyGrid& grid = periodogram.grid;
    const RowBlocks blocks(static_cast<int>(grid.row.size()));
    std::vector<double> sums(static_cast<size_t>(blocks.count));
    for_each_block(blocks.count, [&](int block) {
        SpectralRow row(form, grid.column);
        const auto matrix = [&](const double* entries) {
            LaneMatrix result(d, grid.column.size());
            std::copy_n(entries, 2 * static_cast<size_t>(d) * static_cast<size_t>(d) * result.lanes(),
                        result.real(0, 0));
            return result;
        };
        for (int m = blocks.first(block); m < blocks.last(block); ++m) {
            const auto place = static_cast<size_t>(m);
            row.evaluate(grid.row[place]);
            const LaneMatrix cells = cells_of(periodogram.rows[place], first_plane, d);
            const LaneMatrix inverse = matrix(row.inverse(0));
            LaneMatrix precision;  // Λ R⁻¹ Λ⁻¹ L⁻¹ Λ, or Λ⁻ᴴ Σ⁻¹ Λ⁻¹
            if (pmrf) {
                const LaneMatrix lambda = matrix(row.lambda(0));
                precision = product(product(lambda, product(right, inverse)), product(left, lambda));
            } else {
                precision = product(adjoint(inverse), product(noise, inverse));
            }
            sums[static_cast<size_t>(block)] +=
                grid.row_weight[place] * mean_trace(precision, cells, grid.column_weight);
        }
    });
    double sum = 0.0;
    for (const double part : sums) sum += part;
    return sum;
}

}  // namespace

double log_likelihood(const Model& model, const LagCovariance& statistic, double mean_log_determinant,
                      const std::function<const FoldedPeriodogram&()>& periodogram, int first_plane) {
    const LinearField& field = linear_field(model);
    const SpectralForm form(model);
    const Eigen::LLT<MatrixXd> noise(noise_matrix(field));
    const MatrixXd lower = noise.matrixL();
    const double log_noise = 2.0 * lower.diagonal().array().log().sum();
    double quadratic = 0.0, filters = 0.0;  // ln det S = ln det Σ − filters · ln |det Λ|
    switch (form.kind) {
        case SpectralForm::Kind::autoregressive:
            quadratic = noise.solve(residual_covariance(field, statistic)).trace();
            filters = 2.0;
            break;
        case SpectralForm::Kind::mmrf:
            quadratic = markov_quadratic(field, statistic, noise);
            filters = 1.0;
            break;
        case SpectralForm::Kind::pmrf:
            quadratic = field.planes == 1 ? markov_quadratic(field, statistic, noise)
                                          : periodogram_quadratic(form, periodogram(), first_plane);
            filters = 1.0;
            break;
        case SpectralForm::Kind::moving_average:
            quadratic = periodogram_quadratic(form, periodogram(), first_plane);
            filters = -2.0;
            break;
    }
    const double result = -0.5 * (field.planes * std::log(2.0 * std::numbers::pi) + log_noise -
                                  filters * mean_log_determinant + quadratic);
    return std::isfinite(result) && noise.info() == Eigen::Success ? result
                                                                   : std::numeric_limits<double>::quiet_NaN();
}

void check_dense_hessian(const std::string& asked, size_t unknowns, const char* instead) {
    constexpr size_t most = 6000;  // 0.3 GB of second derivatives
    if (unknowns <= most) return;
    throw InputError(asked,
                     std::to_string(unknowns) +
                         " unknowns of a level have too many second derivatives (at most " +
                         std::to_string(most) + " unknowns)",
                     instead);
}

}  // namespace btfield::detail
