#pragma once

/// \file
/// A BTF as textures that stand for pictures (theory 22): one for each cluster of pictures that look alike
/// (P3), or one for each picture (P4). What is grown in two directions agrees in its noise and in nothing
/// else: for highlights and shadows that belong together see btf_model.hpp.

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
#include "btfield/btf_model.hpp"
#include "btfield/btf_set.hpp"
#include "btfield/device.hpp"
#include "btfield/fit.hpp"
#include "btfield/image.hpp"
#include "btfield/models.hpp"

namespace btfield {

/// What a direction takes of its own.
enum class BtfMatch {
    means,  ///< mean and contrast of each colour; from the texture what else there is
    none,   ///< nothing: all directions of a texture are the same picture (P3)
};
/// "means", "none".
[[nodiscard]] BTFIELD_API std::string_view name(BtfMatch match);

/// Contrasts are standard deviations over means. 0 stands for 0, k from 1 on for
/// smallest_btf_contrast · btf_contrast_step^(k − 1).
inline constexpr double smallest_btf_contrast = 0.002, btf_contrast_step = 1.035;

/// Everything that pictures of any direction need.
struct BtfTextures : BtfMeasured {
    BtfMethod method = BtfMethod::segment;  ///< segment or each
    BtfMatch match = BtfMatch::means;
    /// Of z = √(I / μ), I being the picture of `sources` and μ its means.
    std::vector<TextureModel> textures;
    std::vector<std::uint32_t> sources;  ///< [texture]: the pair whose picture it is a model of
    std::vector<float> texture_means;    ///< [texture][colour]: μ, rounded as those of BtfTables
    std::vector<std::uint16_t> labels;   ///< [pair]: its texture
    /// [pair][colour], rounded likewise, and coded as above; empty where nothing is matched.
    std::vector<float> means;
    std::vector<std::uint8_t> contrasts;
};

/// \throws InputError naming the first defect
BTFIELD_API void check(const BtfTextures& model);

/// Bytes of a model file, by what they are for.
struct BtfTexturesParts {
    std::uint64_t labels = 0, means = 0, contrasts = 0, textures = 0;
    std::uint64_t rest = 0;  ///< directions and what else there is
};
/// \param bytes  of the file, CBOR
[[nodiscard]] BTFIELD_API BtfTexturesParts parts_of(const BtfTextures& model, std::uint64_t bytes);

struct BtfTexturesOptions {
    BtfMethod method = BtfMethod::segment;
    int clusters = 20;  ///< of segment: 1 to 128
    BtfMatch match = BtfMatch::means;
    FitOptions field;  ///< of the textures
    BtfLeaveOut leave_out;
    /// Pictures that are fitted at a time, as far as thread_limit() has threads; 0: as many as it has.
    int jobs = 0;
    /// Of each: what is done goes to this file, and what it holds when the fit begins is not done again: a
    /// fit that ended early goes on where it was. The file stays; whoever has the model written removes it.
    /// Empty: nothing is kept. Parts of shards beside it (fit_btf_shard()) are taken, too, and stay.
    std::filesystem::path part;
    /// Called with the stage ("pictures", "clusters", "textures", "score") and the share of it that is done,
    /// in the caller's thread; what it throws ends the fit.
    std::function<void(std::string_view stage, double share)> progress;
    /// Called before pictures are fitted, in the caller's thread, where shards are missing or have not all of
    /// their pictures: with one sentence that says so. Without it that is a remark of the fit.
    std::function<void(const std::string& remark)> tell;

    /// segment: 3d-msar of order 2 (P3); each: 3d-car of order 3.
    [[nodiscard]] BTFIELD_API static FitOptions field_defaults(BtfMethod method);
    BTFIELD_API explicit BtfTexturesOptions(BtfMethod how = BtfMethod::segment);
};

/// How far statistics of pictures are off that a fit was not shown: medians over pictures.
struct BtfStatistics {
    double mean_error = 0.0;            ///< |difference| of means to the picture's, mean over colours
    double std_error = 0.0;             ///< the same of standard deviations,
    double std_error_95 = 0.0;          ///< not the median, but what 95 % of the pictures are within
    double lag_covariance_error = 0.0;  ///< Comparison::lag_covariance_error
};

struct BtfTexturesScore {
    std::vector<BtfPair> pairs;
    BtfStatistics model;    ///< of grown pictures
    BtfStatistics nearest;  ///< of the nearest picture that was shown
};

struct BtfTexturesFit {
    BtfTextures model;
    std::optional<BtfTexturesScore> score;  ///< of pictures that were left out
    std::vector<std::string> remarks;
    std::size_t resumed = 0;  ///< pictures that parts held
};

/// segment reads every picture once, those of the textures and those left out once more; each reads every
/// picture once. The part does not matter to the result.
/// \throws InputError when options cannot be met, a picture gives no model (the message says which), the part
///     is of another set or other options, or in use, and what BtfSet::picture() refuses
[[nodiscard]] BTFIELD_API BtfTexturesFit
fit_btf_textures(Device& device, const BtfSet& set, const BtfTexturesOptions& options = BtfTexturesOptions());

/// What a shard has done.
struct BtfShardFit {
    std::filesystem::path part;             ///< the file that holds it
    std::size_t pictures = 0, resumed = 0;  ///< all of the shard, and those that the part held before
};
/// Fits every N-th picture of a set by the method each, into a part of its own: that of the options with
/// -I-of-N behind its name. When all shards are done, in whatever processes, fit_btf_textures() with the same
/// set and options joins their parts, and its model is that of one process to the bit; pictures that no part
/// has it fits itself.
/// \param shard  I, 1 to N
/// \throws InputError as fit_btf_textures(), and when the method is not each or no part is named
[[nodiscard]] BTFIELD_API BtfShardFit fit_btf_shard(Device& device, const BtfSet& set,
                                                    const BtfTexturesOptions& options, int shard, int shards);
/// The parts of shards that lie beside a part, by name. Whoever has the joined model written removes them.
[[nodiscard]] BTFIELD_API std::vector<std::filesystem::path> btf_shard_parts(
    const std::filesystem::path& part);

/// What a picture of a direction is made of.
struct BtfTextureLook {
    int texture = 0;
    /// Of each colour, linear light; empty where nothing is matched.
    std::vector<double> mean, deviation;
};

/// Grown textures of one model, size and seed, seen from anywhere. Any number of threads may ask one for
/// pictures at a time. A texture is grown when it is first asked for, and kept while there is room.
class BTFIELD_API BtfTextureSynthesiser {
  public:
    /// \param device is to outlive it
    /// \param allow_invalid  textures whose certificate fails are grown all the same
    /// \throws InputError as check() and check_synthesis() do
    BtfTextureSynthesiser(Device& device, BtfTextures model, Size size, std::uint64_t seed,
                          bool allow_invalid = false);
    ~BtfTextureSynthesiser();
    BtfTextureSynthesiser(BtfTextureSynthesiser&&) noexcept;
    BtfTextureSynthesiser& operator=(BtfTextureSynthesiser&&) noexcept;

    /// The picture under a view and a light, measured or not: linear light from 0 on. A torus where
    /// tileable().
    /// \throws InputError when a direction is not above the surface
    [[nodiscard]] Image picture(const BtfDirection& view, const BtfDirection& light) const;
    /// Its texture, that of the nearest measured direction, and interpolated mean and deviation.
    [[nodiscard]] BtfTextureLook look(const BtfDirection& view, const BtfDirection& light) const;
    /// I of a texture as it was grown: what picture() is where nothing is matched.
    [[nodiscard]] Image texture(int index) const;
    /// A grown texture with the mean and deviation of a look.
    [[nodiscard]] static Image dressed(const Image& texture, const BtfTextureLook& look);
    [[nodiscard]] Size size() const;
    [[nodiscard]] bool tileable() const;
    [[nodiscard]] const BtfTextures& model() const;

  private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

/// Reads and checks a model of textures: JSON, or CBOR, as read_model().
/// \throws InputError as read_model(), and when it is a model of another method
[[nodiscard]] BTFIELD_API BtfTextures read_btf_textures(const std::filesystem::path& path);
/// Writes a model of textures; CBOR when the name ends in .btfm. The file appears complete or not at all.
/// \throws InputError when check() refuses the model or the file cannot be written
BTFIELD_API void write_btf_textures(const std::filesystem::path& path, const BtfTextures& model);

/// How the BTF became the model of a file.
/// \throws InputError as read_model() where it is no model of a BTF
[[nodiscard]] BTFIELD_API BtfMethod btf_method_of(const std::filesystem::path& path);
/// Reads and checks a model of a BTF of either kind, in one pass: pipes will do.
/// \throws InputError as read_model()
[[nodiscard]] BTFIELD_API std::variant<BtfModel, BtfTextures> read_any_btf(const std::filesystem::path& path);

}  // namespace btfield
