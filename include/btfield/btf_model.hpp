#pragma once

/// \file
/// A BTF as one small model (theory 21): planes of the surface, which a random field grows together with the
/// relief, and tables that make a picture of them for any view and light.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/btf_measured.hpp"
#include "btfield/btf_set.hpp"
#include "btfield/compound.hpp"
#include "btfield/device.hpp"
#include "btfield/fit.hpp"
#include "btfield/image.hpp"
#include "btfield/models.hpp"

namespace btfield {

class BtfSynthesiser;
namespace detail {
class SeenPlanes;
const SeenPlanes& seen_planes(const BtfSynthesiser& grown);
}  // namespace detail

/// What is known of measured pictures. Relative ones are √(I / μ) ≈ m + Σ_k U_k T_k where the view shows
/// the surface. U is kept of some pairs, and interpolated of the others (theory 21.3); m and the length of U
/// follow from the contrast.
struct BtfTables {
    /// μ, [pair][colour]: mean of the picture, rounded to half precision where the largest is from 2⁻⁷ to
    /// 65504. 0: a black one.
    std::vector<float> mean;
    /// [pair][colour], in units of log(4) / 127: logarithm of the standard deviation of I / μ to 2 |U|.
    std::vector<std::int8_t> contrast;
    std::vector<std::uint32_t> kept;  ///< indices of pairs, ascending
    /// U, [kept][colour][plane], in units of each plane's `weight_units`.
    std::vector<std::int8_t> weights;
    std::vector<double> weight_units;
};

/// A piece of the surface itself, which the roller makes larger ones of (theory 17).
struct SurfaceSample {
    Size size;
    /// Height in pixels, in units of `height_unit`, and T, [plane][pixel], in units of each plane's.
    std::vector<std::int16_t> height;
    std::vector<std::int8_t> planes;
    double height_unit = 1.0;
    std::vector<double> plane_units;
};

/// What grows the surface.
enum class SurfaceKind {
    field,     ///< a random field
    compound,  ///< regional models behind a control field (compound.hpp)
    roll,      ///< the surface's own pixels (roller.hpp)
};

/// Everything that pictures of any direction need.
struct BtfModel : BtfMeasured {
    BtfTables tables;
    /// Of the relief, in pixels, and of the planes T.
    std::variant<TextureModel, CompoundModel, SurfaceSample> surface;
    double unexplained = 0.0;   ///< share of the variance of z that planes of this number leave
    double table_error = 0.0;   ///< share of it by which interpolated U are off, mean over pairs
    double scale_factor = 1.0;  ///< that the relief was multiplied with
    std::string relief;         ///< where it is from: "given", "set", "stereo" or "level"

    [[nodiscard]] int planes() const { return static_cast<int>(tables.weight_units.size()); }
    [[nodiscard]] SurfaceKind surface_kind() const { return static_cast<SurfaceKind>(surface.index()); }
};

/// "3d-car", …, "compound", "roll": what grows the surface.
[[nodiscard]] BTFIELD_API std::string_view surface_name(const BtfModel& model);
/// Of the surface, a sample's values, and those of the tables.
[[nodiscard]] BTFIELD_API std::size_t parameter_count(const BtfModel& model);
/// Whether its certificates hold; a sample has none to fail.
[[nodiscard]] BTFIELD_API bool is_valid(const BtfModel& model);

/// \throws InputError naming the first defect
BTFIELD_API void check(const BtfModel& model);

struct BtfFitOptions {
    /// T_1 … T_m; fewer where no view has pictures for more.
    int planes = 16;
    /// One plane in pixels; empty: that of the set, or of photometric stereo of the view from above.
    Image height;
    /// Factor on the relief; without one it is found, unless the relief is given or the set's.
    std::optional<double> scale;
    bool find_scale = false;  ///< whatever relief there is
    /// Pictures continue beyond their edges: made sets, and tori.
    bool periodic = false;
    BtfLeaveOut leave_out;
    /// U is kept of so few pairs that interpolation is off by at most this share of `unexplained`.
    /// 0: of all.
    double table_error = 0.2;
    SurfaceKind surface = SurfaceKind::field;
    /// Of the surface's field. The regional models of compound surfaces are compound.hpp's.
    FitOptions field;
    /// Of a compound surface; without one, as CompoundOptions has it.
    std::optional<int> regions;
    /// Views go to this file as they are read, are mapped from it instead of held in memory, and those that
    /// it holds when the fit begins are not read again: a fit that ended early goes on where it was. The set,
    /// `planes` and `leave_out` are to be those that it was begun with, all else may change. Takes 2 m + 16
    /// planes of 16 bits for each view. The file stays; whoever has the model written removes it. Empty:
    /// nothing is kept.
    std::filesystem::path part;
    /// Called with the stage ("pictures", "relief", "scale", "planes", "tables", "field") and the share of it
    /// that is done, in the caller's thread; what it throws ends the fit.
    std::function<void(std::string_view stage, double share)> progress;

    /// 3d-car of order 3.
    [[nodiscard]] BTFIELD_API static FitOptions field_defaults();
    BTFIELD_API BtfFitOptions();
};

/// Errors of pictures that the fit was not shown, as shares: of root mean square differences of pixels to the
/// picture's standard deviation, of means, and of standard deviations.
struct BtfErrors {
    double median = 0.0, mean = 0.0;           ///< of pixels
    double mean_error = 0.0, std_error = 0.0;  ///< medians
};

struct BtfScore {
    std::vector<BtfPair> pairs;
    BtfErrors model;
    BtfErrors nearest;     ///< the nearest picture that was shown
    BtfErrors neighbours;  ///< the four nearest, weighted by the inverse fourth power of their distances
};

struct BtfFit {
    BtfModel model;
    /// Planes as they were found, before a field took their place: height in pixels, then T.
    Image surface;
    /// Of pictures that were left out.
    std::optional<BtfScore> score;
    std::vector<std::string> remarks;
    std::size_t resumed = 0;  ///< pictures of views that the part held
};

/// Reads every picture once, view by view, and those left out once more. Holds each view as 2 m + 16 planes
/// of 16 bits, in memory or in the part, which does not matter to the result.
/// \throws InputError when what is in memory is more than the device's memory limit, when options cannot be
///     met, the relief has another size, a view lacks pictures so that nothing can be learned, the part is of
///     another set or other options, in use or cannot be written, or what BtfSet::picture() refuses
[[nodiscard]] BTFIELD_API BtfFit fit_btf(Device& device, const BtfSet& set,
                                         const BtfFitOptions& options = BtfFitOptions());

/// Grown surfaces of one model, size and seed, seen from anywhere. Any number of threads may ask one for
/// pictures at a time.
class BTFIELD_API BtfSynthesiser {
  public:
    /// \param device is to outlive it; the model need not
    /// \throws InputError as check() and Synthesiser do
    BtfSynthesiser(Device& device, const BtfModel& model, Size size, std::uint64_t seed,
                   bool allow_invalid = false);
    /// Of the surface that the model was fitted to.
    /// \param surface  BtfFit::surface
    BtfSynthesiser(Device& device, const BtfModel& model, const Image& surface);
    ~BtfSynthesiser();
    BtfSynthesiser(BtfSynthesiser&&) noexcept;
    BtfSynthesiser& operator=(BtfSynthesiser&&) noexcept;

    /// The picture under a view and a light, measured or not: linear light, not clamped above. A torus where
    /// tileable().
    /// \throws InputError when a direction is not above the surface
    [[nodiscard]] Image picture(const BtfDirection& view, const BtfDirection& light) const;
    [[nodiscard]] Size size() const;
    [[nodiscard]] bool tileable() const;
    /// Height in pixels, then T.
    [[nodiscard]] const Image& surface() const;

  private:
    friend const detail::SeenPlanes& detail::seen_planes(const BtfSynthesiser& grown);
    class Impl;
    std::unique_ptr<Impl> impl_;
};

/// Reads and checks a BTF model: JSON, or CBOR, as read_model().
/// \throws InputError as read_model()
[[nodiscard]] BTFIELD_API BtfModel read_btf_model(const std::filesystem::path& path);
/// Writes a BTF model; CBOR when the name ends in .btfm. The file appears complete or not at all.
/// \throws InputError when check() refuses the model or the file cannot be written
BTFIELD_API void write_btf_model(const std::filesystem::path& path, const BtfModel& model);

}  // namespace btfield
