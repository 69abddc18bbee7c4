#pragma once

/// \file
/// Random-field models as plain data. All arithmetic on them lives elsewhere.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/image.hpp"
#include "btfield/image_io.hpp"
#include "btfield/marginals.hpp"
#include "btfield/neighbourhood.hpp"
#include "btfield/spectral_basis.hpp"

namespace btfield {

/// Linear part shared by the autoregressive models: y_i(r) = Σ_s Σ_j a_{s,i,j} y_j(r ⊕ s) + (noise)_i. Of
/// moving averages the coefficients weigh the noise: see MaModel. A field is its support, so that what fits a
/// support fits that of a model again.
struct LinearField : Support {
    int planes = 0;
    /// a_{s,i,j} at [(s·d + i)·d + j]; 0 where the support lacks it.
    std::vector<double> coefficients;
    /// Σ, d × d row-major, symmetric positive definite; diagonal when the noise form is diagonal.
    std::vector<double> noise_covariance;
};

/// Causal autoregressive (theory 6; P4 2.1, 2.2): causal or unilateral support, Σ full or diagonal.
struct CarModel : LinearField {};

/// Simultaneous autoregressive, MSAR (theory 7; P0; P3; P4 2.5): any support, Λ_t Ỹ_t = Σ^{1/2} ε̃_t.
struct SarModel : LinearField {};

/// Which Markov random field (theory 8.1, 8.2; P4 2.6, 2.7).
enum class MrfForm {
    mmrf,  ///< S_Y = Λ⁻¹ Σ; Σ⁻¹ Λ_t Hermitian positive definite
    pmrf,  ///< S_Y = Λ⁻¹ Σ^{1/2} Λ Σ^{1/2} Λ⁻¹, Σ^{1/2} the symmetric root; Λ_t Hermitian positive definite
};

/// Markov random field: the noise is correlated such that it is the error of the best prediction from all
/// neighbours. Symmetric support (s and −s both listed). MMRF: Σ⁻¹ A_{−s} = (Σ⁻¹ A_s)ᵀ. PMRF: A_{−s} = A_sᵀ.
struct MrfModel : LinearField {
    MrfForm form = MrfForm::mmrf;
};

/// Moving average (theory 9; P1 2.3; P4 2.3, 2.4): y_i(r) = Σ_s Σ_j a_{s,i,j} e_j(r ⊖ s), e white with
/// covariance Σ. The offsets are where an impulse of the noise shows, y(r ⊕ s) += A_s e(r); the centre is
/// among them. Σ is positive semidefinite.
struct MaModel : LinearField {};

using Model = std::variant<CarModel, SarModel, MrfModel, MaModel>;

/// The linear part of whichever model it is.
[[nodiscard]] BTFIELD_API const LinearField& linear_field(const Model& model);

/// The ten models of P4 section 2: 2D ones are d independent single-plane models of the KLT planes, 3D ones
/// one model of all planes.
enum class ModelKind { car2d, car3d, ma2d, ma3d, msar2d, msar3d, mmrf2d, mmrf3d, pmrf2d, pmrf3d };
/// All of them, in the order above.
[[nodiscard]] BTFIELD_API std::span<const ModelKind> model_kinds();
/// "2d-car", "3d-car", "2d-ma", …
[[nodiscard]] BTFIELD_API std::string_view name(ModelKind kind);
/// Inverse of name().
/// \throws InputError for any other text, listing those that exist
[[nodiscard]] BTFIELD_API ModelKind model_kind(std::string_view name);
[[nodiscard]] BTFIELD_API bool is_2d(ModelKind kind);

/// What ModelKind leaves when the number of dimensions is set aside.
enum class Family { car, ma, msar, mmrf, pmrf };
[[nodiscard]] BTFIELD_API Family family(ModelKind kind);
/// The field as a model of the family.
[[nodiscard]] BTFIELD_API Model model_of(Family family, LinearField field);

/// How a level was estimated.
enum class Estimator {
    least_squares,
    maximum_likelihood,
    random_decrement,  ///< of moving averages (P4 2.3, 2.4)
    spectral_root,     ///< of moving averages of regions (theory 18.4)
};
/// "ls", "ml", "rd", "sr".
[[nodiscard]] BTFIELD_API std::string_view name(Estimator estimator);
[[nodiscard]] BTFIELD_API Estimator estimator(std::string_view name);

enum class NoiseForm { full, diagonal };
/// "full", "diagonal".
[[nodiscard]] BTFIELD_API std::string_view name(NoiseForm form);
[[nodiscard]] BTFIELD_API NoiseForm noise_form(std::string_view name);

/// What the spectrum of one level's model says about it (theory 10).
struct Certificate {
    /// Proven: det Λ has no zero on the whole torus, Λ_t is positive definite where the model is Markov, and
    /// every variance ratio is at most 10. Of a moving average, which is a field whatever its coefficients,
    /// the ratios alone.
    bool valid = false;
    /// min_t σ_min(Λ_t) over the grid and its refinement; of Markov models the smallest eigenvalue of the
    /// Hermitian Σ^{-1/2} Λ_t Σ^{1/2} (MMRF) or Λ_t (PMRF), below 0 when it is not definite; of a moving
    /// average that of its transfer function.
    double min_singular = 0.0;
    /// Zeros of det Λ on the frequency torus: point zeros by winding number, and where det Λ is real
    /// (symmetric coefficients, Markov models) the grid cells that the zero curve crosses. A model may be
    /// invalid without a zero: singular to six digits somewhere, or so close to it along a curve that nothing
    /// can be proven.
    int zeros = 0;
    /// Per plane, model variance / data variance, without the level gain. The variance is that of the
    /// infinite lattice, narrow peaks of the spectrum integrated to about 1 %; that of the 128 × 128 torus
    /// when there are zeros.
    std::vector<double> variance_ratio;
};

/// One pyramid level: its own model on its own torus.
struct LevelModel {
    Size size;  ///< of the level in the analysed picture
    /// 3D: one model of all modelled planes; 2D: one single-plane model per KLT plane.
    std::vector<Model> models;
    double gain = 1.0;  ///< standard-deviation factor applied at synthesis (theory 12.2)
    Estimator estimator = Estimator::least_squares;  ///< ml when any plane of a 2D level took it
    int iterations = 1;                              ///< 2D: of all planes together
    /// Whittle log-likelihood per pixel of the level under the model without its gain, natural logarithm, 2D:
    /// summed over planes; NaN when the certificate fails or the model has no density, as moving averages
    /// whose transfer function vanishes somewhere.
    double log_likelihood = 0.0;
    /// 2D: the least of the planes' singular values, the sum of their zeros, valid when all are.
    Certificate certificate;
};

/// What a map tells of a material.
enum class MapRole { colour, normal, height, roughness, metalness, occlusion, opacity, other };
/// "colour", "normal", "height", …
[[nodiscard]] BTFIELD_API std::string_view name(MapRole role);
/// Inverse of name().
/// \throws InputError for any other text, listing those that exist
[[nodiscard]] BTFIELD_API MapRole map_role(std::string_view name);

/// One of several maps of a material that are modelled together (theory 20), in the order of their planes.
struct MaterialMap {
    std::string name;  ///< file name of the picture, without folders
    MapRole role = MapRole::other;
    /// Of the model's planes. 0: a normal map that the height tells; 1 of a normal map without a height map:
    /// (−Δ)^{1/2} of the height that it tells (theory 20.3).
    int planes = 0;
    ColourSpace space = ColourSpace::unspecified;
    PixelType type = PixelType::uint8;
    std::uint64_t file_bytes = 0;  ///< size of the picture's file; 0: not known
    /// Of heights in pixels, about 0: how far apart black and white of their files are. 0: heights as their
    /// file has them, whose scale nothing tells, and all other maps.
    double scale = 0.0;
    bool directx = false;  ///< of a normal map: its second colour points down
    /// Of heights in pixels: what levels of a texture's pyramid by factor 2 are multiplied with, finest
    /// first (theory 20.2).
    std::vector<double> gains = {};
};

/// Where the model came from; for people, not for synthesis, but for the file type of the output.
struct Provenance {
    std::string source;                 ///< file name without folders
    PixelType type = PixelType::uint8;  ///< storage of the analysed picture
    std::uint64_t picture_bytes = 0;    ///< uncompressed size of the analysed pixels
    std::string software;               ///< "btfield 0.1.0"
    std::vector<std::string> reasons;   ///< why model, order or levels are what they are, where fit() chose
    /// Of the picture's file, where they are not those of its colour space: EXR and HDR textures are written
    /// in them again.
    std::optional<Chromaticities> chromaticities = {};
    std::uint64_t file_bytes = 0;  ///< size of the picture's file; 0: not known
    /// Which planes of the picture reach 0 or 1; empty where that is not known, or none does.
    std::vector<PlaneLimits> limits = {};
    /// Of a material; empty for one picture.
    std::vector<MaterialMap> maps = {};
};

/// Everything that synthesis needs.
struct TextureModel {
    ModelKind kind = ModelKind::car3d;
    Size size;  ///< of the analysed picture
    int planes = 0;
    ColourSpace space = ColourSpace::unspecified;
    std::vector<std::string> names;  ///< of the planes, as the picture has them: empty, or one for each
    std::vector<ColourSpace> plane_spaces;  ///< Image::plane_spaces() of the picture: textures get them
    int factor = 2;                         ///< pyramid reduction factor n
    NoiseForm noise = NoiseForm::full;
    std::vector<double> mean;  ///< μ, one per plane of the picture
    /// T of 2D models and of models with marginals (theory 3): the levels model T (Y − μ). Without planes
    /// otherwise: the levels model Y − μ.
    SpectralBasis basis;
    /// Of T (Y − μ), one per row of T: the levels model these planes mapped to standard normal ones. Empty
    /// where values are modelled as they are.
    std::vector<Marginal> marginals;
    /// M, r × r row-major, symmetric, of models with marginals (theory 13.3): M x is what the marginals map,
    /// x what the levels add up to. It makes variances 1 and correlations 0 at lag 0, as the picture's own
    /// planes T (Y − μ) have them, whatever the levels left of these: histograms and spectral covariance are
    /// the picture's.
    std::vector<double> whitening;
    std::vector<LevelModel> levels;  ///< finest first; the last one is the Gaussian level
    Provenance provenance;
};

/// Planes that the levels model: rows of T, or the picture's planes where there is no T.
[[nodiscard]] BTFIELD_API int modelled_planes(const TextureModel& model);

/// Numbers that the file must store to synthesise: coefficients, Σ (its free entries), gains, means, T (its
/// free entries, as rotations) and the marginals' knots.
[[nodiscard]] BTFIELD_API std::size_t parameter_count(const TextureModel& model);
/// Those of a level: free coefficients and free entries of Σ, without the gain.
[[nodiscard]] BTFIELD_API std::size_t parameter_count(const LevelModel& level, NoiseForm noise);

/// True when every level's certificate is valid.
[[nodiscard]] BTFIELD_API bool is_valid(const TextureModel& model);

/// \throws InputError naming the first defect: sizes that disagree, non-finite numbers, duplicate or zero
///     offsets, offsets that CAR cannot have, coefficients that are not those of a Markov model, a Σ that is
///     not symmetric positive definite, negative gains, no level
BTFIELD_API void check(const TextureModel& model);

}  // namespace btfield
