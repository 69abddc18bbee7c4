#include "host/likelihood.hpp"

#include <Eigen/Cholesky>
#include <cstddef>
#include <limits>
#include <numbers>

#include "host/least_squares.hpp"
#include "host/spectral_form.hpp"

namespace btfield {
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

}  // namespace

double log_likelihood(const Model& model, const LagCovariance& statistic, double mean_log_determinant) {
    const LinearField& field = linear_field(model);
    const auto* markov = std::get_if<MrfModel>(&model);
    if (std::holds_alternative<MaModel>(model) || (markov != nullptr && markov->form == MrfForm::pmrf))
        return std::numeric_limits<double>::quiet_NaN();
    const Eigen::LLT<MatrixXd> noise(noise_matrix(field));
    const MatrixXd lower = noise.matrixL();
    const double log_noise = 2.0 * lower.diagonal().array().log().sum();
    const double quadratic = markov != nullptr ? markov_quadratic(field, statistic, noise)
                                               : noise.solve(residual_covariance(field, statistic)).trace();
    const double filters = markov != nullptr ? 1.0 : 2.0;  // Λ⁻¹ in S once, or twice
    return -0.5 * (field.planes * std::log(2.0 * std::numbers::pi) + log_noise -
                   filters * mean_log_determinant + quadratic);
}

}  // namespace btfield
