#pragma once

/// \file
/// Random-field models as plain data. All arithmetic on them lives elsewhere.

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "btfield/certificate.hpp"
#include "btfield/image.hpp"
#include "btfield/image_io.hpp"
#include "btfield/neighbourhood.hpp"

namespace btfield {

/// Linear part shared by the autoregressive models: y_i(r) = Σ_s Σ_j a_{s,i,j} y_j(r ⊕ s) + (noise)_i.
struct LinearField {
    int planes = 0;
    NeighbourhoodKind kind = NeighbourhoodKind::custom;
    std::vector<Offset> offsets;
    /// a_{s,i,j} at [(s·d + i)·d + j].
    std::vector<double> coefficients;
    /// Per-pair sets I_r^{ij}: 1 where a_{s,i,j} exists, laid out as coefficients; empty = every pair has
    /// every offset. Absent coefficients are 0.
    std::vector<std::uint8_t> active;
    /// Σ, d × d row-major, symmetric positive definite; diagonal when the noise form is diagonal.
    std::vector<double> noise_covariance;
};

/// Causal autoregressive (P4 2.1, 2.2): causal or unilateral support, Σ full or diagonal.
struct CarModel : LinearField {};

/// Simultaneous autoregressive, MSAR (P0; P3; P4 2.5): any support, Λ_t Ỹ_t = Σ^{1/2} ε̃_t.
struct SarModel : LinearField {};

/// Which Markov random field (P4 2.6, 2.7).
enum class MrfForm {
    mmrf,  ///< S_Y = Λ⁻¹ Σ; Σ⁻¹ Λ_t Hermitian positive definite
    pmrf,  ///< S_Y = Λ⁻¹ Σ^{1/2} Λ Σ^{1/2} Λ⁻¹, Σ^{1/2} the symmetric root; Λ_t Hermitian positive definite
};

/// Markov random field: the noise is correlated such that it is the error of the best prediction from all
/// neighbours. Symmetric support (s and −s both listed). MMRF: Σ⁻¹ A_{−s} = (Σ⁻¹ A_s)ᵀ. PMRF: A_{−s} = A_sᵀ.
struct MrfModel : LinearField {
    MrfForm form = MrfForm::mmrf;
};

/// Moving average (P1 2.3; P4 2.3, 2.4): y_i(r) = Σ_s Σ_j a_{s,i,j} e_j(r ⊖ s), e white with covariance Σ.
/// The offsets are where an impulse of the noise shows, y(r ⊕ s) += A_s e(r); the centre is among them. Σ is
/// positive semidefinite.
struct MaModel : LinearField {};

using Model = std::variant<CarModel, SarModel, MrfModel, MaModel>;

/// The linear part of whichever model it is.
[[nodiscard]] const LinearField& linear_field(const Model& model);

enum class ModelKind { car3d, msar3d };
/// "3d-car", "3d-msar".
[[nodiscard]] std::string_view name(ModelKind kind);
/// Inverse of name(); throws InputError for any other text, listing those that exist.
[[nodiscard]] ModelKind model_kind(std::string_view name);

/// How a level was estimated.
enum class Estimator { least_squares };
/// "ls".
[[nodiscard]] std::string_view name(Estimator estimator);
[[nodiscard]] Estimator estimator(std::string_view name);

enum class NoiseForm { full, diagonal };
/// "full", "diagonal".
[[nodiscard]] std::string_view name(NoiseForm form);
[[nodiscard]] NoiseForm noise_form(std::string_view name);

/// One pyramid level: its own model on its own torus.
struct LevelModel {
    Size size;  ///< of the level in the analysed picture
    Model model;
    double gain = 1.0;  ///< standard-deviation factor applied at synthesis (MODELS section 11)
    Estimator estimator = Estimator::least_squares;
    int iterations = 1;
    /// Whittle log-likelihood per pixel of the level under the model without its gain, natural logarithm; NaN
    /// when the certificate fails, because the likelihood is not defined there.
    double log_likelihood = 0.0;
    Certificate certificate;
};

/// Where the model came from; for people, not for synthesis, but for the file type of the output.
struct Provenance {
    std::string source;                 ///< file name without folders
    PixelType type = PixelType::uint8;  ///< storage of the analysed picture
    std::uint64_t picture_bytes = 0;    ///< uncompressed size of the analysed pixels
    std::string software;               ///< "btfield 0.1.0"
};

/// Everything that synthesis needs.
struct TextureModel {
    ModelKind kind = ModelKind::car3d;
    Size size;  ///< of the analysed picture
    int planes = 0;
    ColourSpace space = ColourSpace::unspecified;
    int factor = 2;  ///< pyramid reduction factor n
    NoiseForm noise = NoiseForm::full;
    std::vector<double> mean;        ///< μ, one per plane
    std::vector<LevelModel> levels;  ///< finest first; the last one is the Gaussian level
    Provenance provenance;
};

/// Numbers that the file must store to synthesise: coefficients, Σ (its free entries), gains and means.
[[nodiscard]] std::size_t parameter_count(const TextureModel& model);

/// True when every level's certificate is valid.
[[nodiscard]] bool is_valid(const TextureModel& model);

/// \throws InputError naming the first defect: sizes that disagree, non-finite numbers, duplicate or zero
/// offsets,
///         offsets that CAR cannot have, a Σ that is not symmetric positive definite, negative gains, no
///         level.
void check(const TextureModel& model);

}  // namespace btfield
