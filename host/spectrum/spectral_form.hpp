#pragma once

// How a model shapes the spectrum of white noise, one form for all families (theory 6 to 9).

#include "btfield/models.hpp"
#include "host/base/eigen.hpp"

namespace btfield::detail {

/// Spectral density of a level's field from the matrix Λ_t = I − Σ_s A_s e^{√−1 ω_t·s} of `lambda`.
struct SpectralForm {
    /// In the order of the kernels' BTFIELD_FACTOR.
    enum class Kind {
        autoregressive,  ///< S = Λ⁻¹ Σ Λ⁻ᴴ (P4 eq. 33)
        mmrf,            ///< S = Λ⁻¹ Σ, Hermitian (P4 2.6)
        pmrf,  ///< S = Λ⁻¹ left Λ right Λ⁻ᴴ, left = right = Σ^{1/2} in the planes' own basis (P4 2.7)
        moving_average,  ///< S = Λ Σ Λᴴ, Λ_t = Σ_s A_s e^{−√−1 ω_t·s} of the model's own coefficients
    };
    Kind kind = Kind::autoregressive;
    LinearField lambda;
    Eigen::MatrixXd left, right;  ///< pmrf only

    // Implicit, so that whatever takes a form takes every model.
    SpectralForm(const LinearField& field);  // NOLINT(google-explicit-constructor)
    SpectralForm(const CarModel& model);     // NOLINT(google-explicit-constructor)
    SpectralForm(const SarModel& model);     // NOLINT(google-explicit-constructor)
    SpectralForm(const MrfModel& model);     // NOLINT(google-explicit-constructor)
    SpectralForm(const MaModel& model);      // NOLINT(google-explicit-constructor)
    SpectralForm(const Model& model);        // NOLINT(google-explicit-constructor)

    [[nodiscard]] int planes() const { return lambda.planes; }
    /// Λ must be Hermitian positive definite up to a change of basis: its eigenvalues are real, and zeros of
    /// det Λ lie on curves.
    [[nodiscard]] bool is_markov() const { return kind == Kind::mmrf || kind == Kind::pmrf; }
};

/// Λ as the synthesis kernels and spectral sums see a moving average: offsets turned round, the centre's
/// coefficient I − A_0, the others −A_s, so that I − Σ … is the transfer function B_t.
[[nodiscard]] LinearField transfer_field(const MaModel& model);

/// Σ as a matrix.
[[nodiscard]] Eigen::MatrixXd noise_matrix(const LinearField& field);

/// The symmetric root of a symmetric positive semidefinite matrix; eigenvalues below 0 by rounding count as
/// 0.
[[nodiscard]] Eigen::MatrixXd symmetric_root(const Eigen::MatrixXd& matrix);

/// Its inverse. Eigenvalues are taken as at least 10⁻¹² of the largest.
[[nodiscard]] Eigen::MatrixXd inverse_symmetric_root(const Eigen::MatrixXd& matrix);

/// The symmetric M with M S M = C, S and C symmetric and positive semidefinite.
[[nodiscard]] Eigen::MatrixXd matching_matrix(const Eigen::MatrixXd& s, const Eigen::MatrixXd& c);

/// The same field seen in another basis of planes, y' = T y: A' = T A T⁻¹, Σ' = T Σ Tᵀ.
[[nodiscard]] LinearField change_basis(const LinearField& field, const Eigen::MatrixXd& basis,
                                       const Eigen::MatrixXd& inverse);
[[nodiscard]] SpectralForm change_basis(const SpectralForm& form, const Eigen::MatrixXd& basis,
                                        const Eigen::MatrixXd& inverse);

}  // namespace btfield::detail
