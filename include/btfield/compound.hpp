#pragma once

/// \file
/// The compound model (theory 18; P1): a control field switches between regional models of a picture, and the
/// roller grows the control field.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/control_field.hpp"
#include "btfield/device.hpp"
#include "btfield/fit.hpp"
#include "btfield/image.hpp"
#include "btfield/models.hpp"

namespace btfield {

/// What the regional models are models of, and so what happens where regions meet (theory 18.3).
enum class Borders {
    conditional,  ///< the residual about E[Y | X around r]: what a pixel is where labels lie as they do
    swap,         ///< deviations from the regional mean; pixels on both sides of a border change places at
                  ///< random and are smoothed (P1 2.3)
    none,         ///< deviations from the regional mean
};
/// "conditional", "swap", "none".
[[nodiscard]] BTFIELD_API std::string_view name(Borders borders);

/// Scales σ = 1, 2, 4, 8 pixels at which the conditional mean sees labels, each with two derivatives.
inline constexpr int context_scales = 4;
/// Pairs of a pixel's eight neighbours that are opposite each other.
inline constexpr int context_pairs = 4;
/// Numbers that a region has per plane: its own pixels, three at each scale, and those pairs.
inline constexpr int context_filters = 1 + 3 * context_scales + context_pairs;

struct CompoundRegion {
    double share = 0.0;          ///< of the analysed pixels
    std::size_t pixels = 0;      ///< analysed
    std::vector<double> colour;  ///< mean, one per plane
    /// [filter][plane]: what a pixel of this region adds to the conditional mean around it, filters as
    /// theory 18.3 numbers them; of borders without context one filter, the pixel itself.
    std::vector<double> weights;
    /// Deviations from `colour` are multiplied by this.
    double contrast = 1.0;
    /// Share of the conditional mean's deviations from `colour` that is kept; 0 where the residual is all
    /// that varies.
    double structure = 1.0;
    /// Of the residual; its planes, means and marginals are the residual's. Levels count from the finest.
    TextureModel residual;
};

/// Everything that synthesis needs.
struct CompoundModel {
    Size size;  ///< of the analysed picture
    int planes = 0;
    ColourSpace space = ColourSpace::unspecified;
    std::vector<std::string> names;  ///< of the planes, as the picture has them: empty, or one for each
    std::vector<ColourSpace> plane_spaces;  ///< Image::plane_spaces() of the picture: textures get them
    Borders borders = Borders::conditional;
    /// What the roller grows control fields of. Its regions are those of `regions`.
    ControlField control;
    /// Opposite edges of `control` continue each other: it is a roller's tile.
    bool periodic = false;
    std::vector<double> mean;  ///< added to the conditional mean, one per plane
    std::vector<CompoundRegion> regions;
    double explained = 0.0;  ///< share of the picture's variance that the labels explain
    Provenance provenance;
};

/// As TextureModel's: colours, weights, contrasts, means and the residuals' parameters. Labels are not
/// counted.
[[nodiscard]] BTFIELD_API std::size_t parameter_count(const CompoundModel& model);

/// True when every region's residual is.
[[nodiscard]] BTFIELD_API bool is_valid(const CompoundModel& model);

/// Means of the regions as 8-bit colours, made distinct: the palette of label pictures.
[[nodiscard]] BTFIELD_API std::vector<PaletteColour> palette(const CompoundModel& model);

/// \throws InputError naming the first defect: what check() of the control field or of a residual refuses,
///     numbers of regions, planes or weights that disagree, residuals of unlike pyramid factors, numbers
///     that are not finite, a contrast below 0
BTFIELD_API void check(const CompoundModel& model);

/// How moving averages of regions are estimated (theory 18.4).
enum class AveragesEstimator {
    spectral_root,     ///< the symmetric root of the spectrum that covariances inside the region have
    random_decrement,  ///< over the region's significant pixels (P1 2.3)
};
/// "sr", "rd".
[[nodiscard]] BTFIELD_API std::string_view name(AveragesEstimator estimator);

struct CompoundOptions {
    ClusterOptions clusters;
    /// The control field of the picture, instead of clusters.
    std::optional<ControlField> labels;
    /// Part of the control field that the model keeps, as a roller's tile; all of it without one.
    std::optional<Size> tile;
    Borders borders = Borders::conditional;
    /// Of the regional models: model, order, neighbourhood, levels (0: three, or fewer where the picture is
    /// small), factor, estimator, noise (not of spectral roots), gains, marginals, prior and moving_average
    /// count; the rest is not read.
    FitOptions local = local_defaults();
    AveragesEstimator averages = AveragesEstimator::spectral_root;
    /// Called with stage names ("control field", "conditional mean", "regions") and the seconds each
    /// took, in the caller's thread; what it throws ends the fit.
    std::function<void(std::string_view stage, double seconds)> progress;

    /// 3d-ma of order 5.
    [[nodiscard]] BTFIELD_API static FitOptions local_defaults();
};

/// \throws InputError when picture or options cannot give a model: an empty or constant picture, NaN or
///     infinities, labels of another size, more regions than colours, a level smaller than the support, a
///     tile that the roller refuses
[[nodiscard]] BTFIELD_API CompoundModel fit_compound(Device& device, const Image& image,
                                                     const CompoundOptions& options = {});

/// Whether a model can be grown as asked, as far as that can be told without a device.
/// \throws InputError when check() refuses the model, a certificate fails (unless allowed), or a side is
///     below 16 pixels or above 16384
BTFIELD_API void check_synthesis(const CompoundModel& model, Size size, bool allow_invalid = false);

/// Holds what textures of one model and size share. Any number of threads may ask one for textures at a time.
class BTFIELD_API CompoundSynthesiser {
  public:
    /// \param device is to outlive it; the model need not
    /// \throws InputError as check_synthesis() does
    /// \throws DeviceError when the device's memory cannot hold the work
    CompoundSynthesiser(Device& device, const CompoundModel& model, Size size, bool allow_invalid = false);
    ~CompoundSynthesiser();
    CompoundSynthesiser(CompoundSynthesiser&&) noexcept;
    CompoundSynthesiser& operator=(CompoundSynthesiser&&) noexcept;

    /// The roller's control field of this seed, of lattice() size.
    [[nodiscard]] ControlField control_field(std::uint64_t seed);
    /// The same. `progress` is told, in the caller's thread, what share of the work is done at least: a field
    /// whose regions are not the sample's shares is drawn again, so that it may jump to 1. What it throws
    /// ends the work.
    [[nodiscard]] ControlField control_field(std::uint64_t seed, const std::function<void(double)>& progress);
    /// Texture of one seed on control_field(seed): a pure function of (model, size, seed), to 1e-4 of full
    /// scale on any device. In units of the analysed picture's values, not clamped.
    [[nodiscard]] Image synthesise(std::uint64_t seed);
    /// The same; `progress` as control_field() has it.
    [[nodiscard]] Image synthesise(std::uint64_t seed, const std::function<void(double)>& progress);
    /// Texture on this control field, of size() or lattice() size.
    /// \throws InputError when it has another size, or more regions than the model
    [[nodiscard]] Image synthesise(std::uint64_t seed, const ControlField& field);
    /// The same texture in device memory, as Synthesiser::synthesise_to() has it.
    /// \throws InputError as above, or when the memory is of another device's context or too small
    void synthesise_to(std::uint64_t seed, const ControlField& field, const DeviceMemory& target);

    [[nodiscard]] Size size() const;
    /// Lattice that is computed before cropping.
    [[nodiscard]] Size lattice() const;
    /// True when opposite edges of the result continue each other, provided that the control field's do.
    [[nodiscard]] bool tileable() const;

  private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

/// A region that other regions' models take the place of, or whose look is changed (theory 18.6; P1 3).
/// Sets the region's mean colour; where it meets others the change follows its smoothed border.
/// \throws InputError when there is no such region, or another number of planes
BTFIELD_API void recolour(CompoundModel& model, int region, std::span<const double> colour);
/// Multiplies the region's deviations from its mean colour.
/// \throws InputError when there is no such region, or the factor is not a finite number >= 0
BTFIELD_API void scale_contrast(CompoundModel& model, int region, double factor);
/// The region takes colour, contrast and residual of region `from` of another material.
/// \throws InputError when there is no such region, planes differ in number, or the pyramids' factors differ
BTFIELD_API void transplant(CompoundModel& model, int region, const CompoundModel& other, int from);
/// The region takes mean and all deviations of a material without regions.
/// \throws InputError as above
BTFIELD_API void transplant(CompoundModel& model, int region, const TextureModel& other);

/// Reads and checks a compound model: JSON or CBOR, as read_model().
/// \throws InputError as read_model()
[[nodiscard]] BTFIELD_API CompoundModel read_compound(const std::filesystem::path& path);
/// Writes a compound model; CBOR when the name ends in .btfm. The file appears complete or not at all.
/// \throws InputError when check() refuses the model or the file cannot be written
BTFIELD_API void write_compound(const std::filesystem::path& path, const CompoundModel& model);
/// Reads and checks a model of either kind, in one pass: pipes will do.
/// \throws InputError as read_model()
[[nodiscard]] BTFIELD_API std::variant<TextureModel, CompoundModel> read_any_model(
    const std::filesystem::path& path);

}  // namespace btfield
