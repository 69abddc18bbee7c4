#include "host/likelihood.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

#include "host/least_squares.hpp"
#include "host/local_lambda.hpp"
#include "host/parallel.hpp"
#include "host/spectral_form.hpp"

namespace btfield {
namespace {

using Eigen::MatrixXcd;
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

/// mean_t tr(S_t⁻¹ I_t) over the cells of the periodogram.
double periodogram_quadratic(const SpectralForm& form, const FoldedPeriodogram& periodogram,
                             int first_plane) {
    const int d = form.planes();
    const LocalLambda<Eigen::Dynamic> lambda(form.lambda);
    const MatrixXcd noise = noise_matrix(form.lambda).inverse().cast<std::complex<double>>();
    const bool pmrf = form.kind == SpectralForm::Kind::pmrf;
    const MatrixXcd left = pmrf ? MatrixXcd(form.left.inverse().cast<std::complex<double>>()) : MatrixXcd();
    const MatrixXcd right = pmrf ? MatrixXcd(form.right.inverse().cast<std::complex<double>>()) : MatrixXcd();
    const FrequencyGrid& grid = periodogram.grid;
    std::vector<double> sums(grid.row.size());
    for_each_block(static_cast<int>(grid.row.size()), [&](int block) {
        const auto m = static_cast<size_t>(block);
        MatrixXcd cell(d, d);
        for (size_t n = 0; n < grid.column.size(); ++n) {
            for (int i = 0; i < d; ++i) {
                for (int j = 0; j < d; ++j) {
                    cell(i, j) = {periodogram.rows[m].real(first_plane + i, first_plane + j)[n],
                                  periodogram.rows[m].imaginary(first_plane + i, first_plane + j)[n]};
                }
            }
            const MatrixXcd value = lambda.at(grid.row[m], grid.column[n]);
            const MatrixXcd inverse = value.inverse();
            const MatrixXcd precision = pmrf ? MatrixXcd(value * right * inverse * left * value)
                                             : MatrixXcd(inverse.adjoint() * noise * inverse);
            sums[m] += grid.row_weight[m] * grid.column_weight[n] * (precision * cell).trace().real();
        }
    });
    double sum = 0.0;
    for (const double row : sums) sum += row;
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

}  // namespace btfield
