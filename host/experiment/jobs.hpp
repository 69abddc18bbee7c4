#pragma once

/// \file
/// What an experiment consists of: pictures, jobs, and the names under which results are kept.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "btfield/experiment.hpp"

namespace btfield::detail {

class OpenSets;

/// Which picture of a BTF, and how the set is read; the crop is the picture's.
struct DirectionSource {
    std::string set_name;  ///< path as the configuration leads to it
    BtfOptions reading;
    ExperimentDirections at;
    BtfDirection true_light;        ///< where light came from
    std::filesystem::path model{};  ///< of the set; empty: none
    std::string model_content{};    ///< SHA-256 of the file
};

struct PictureShape {
    Size size;
    int planes = 0;
};

/// What a picture of a BTF was when it was read.
struct KnownPicture {
    std::string stamp;  ///< BtfSet::stamp()
    std::string content;
    PictureShape shape;
};
/// By set, reading and directions.
using KnownPictures = std::map<std::string, KnownPicture>;

/// A picture that the configuration names.
struct PictureSource {
    std::string name;  ///< path as the configuration leads to it: relative where it is; and directions
    std::filesystem::path file;  ///< or folder, of a BTF
    std::string material;
    std::optional<Crop> crop;
    double white = 1.0;
    std::string content;  ///< SHA-256 of the file; of a picture of a BTF that of its values
    std::string picture;  ///< SHA-256 of content, crop and white level: what results depend on
    std::optional<DirectionSource> direction{};
    std::optional<PictureShape> shape{};  ///< where it was read already
};

/// What distinguishes the jobs of one picture. Rolls and pictures of BTF models have order and levels 0: only
/// the seed matters, and what the models are.
struct JobSettings {
    ExperimentModel model = ExperimentModel::car3d;
    int order = 1;
    int levels = 1;
    EstimatorChoice estimator = EstimatorChoice::automatic;
    MarginalMode marginals = MarginalMode::match;
    std::uint64_t seed = 0;
    std::string btf_models{};  ///< of ExperimentModel::btf: see btf_models_content()
    friend bool operator==(const JobSettings&, const JobSettings&) = default;
};

/// CAR models are estimated by least squares, moving averages, those of compound models too, by random
/// decrement, whatever is asked; rolls not at all.
[[nodiscard]] bool has_one_estimator(ExperimentModel model);
[[nodiscard]] NoiseForm noise_of(const ExperimentConfig& config, ExperimentModel model);
[[nodiscard]] GainMode gains_of(const ExperimentConfig& config, ExperimentModel model);

/// Rolls and BTF models are not fitted to pictures here.
[[nodiscard]] bool has_levels(ExperimentModel model);

/// True when both textures come from one model.
[[nodiscard]] bool same_fit(const JobSettings& a, const JobSettings& b);

/// Marginals of what has_levels() not, which are its own whatever is asked of models.
inline constexpr std::string_view any_marginals = "any";
/// "match", "none", or any_marginals.
[[nodiscard]] std::string_view marginals_text(const JobSettings& settings);

enum class JobStatus { done, refused, failed };
[[nodiscard]] std::string_view name(JobStatus status);
[[nodiscard]] JobStatus job_status(std::string_view name);

/// One row of the database.
struct JobResult {
    std::string key;
    std::string picture;
    JobSettings settings;
    std::string metric;
    std::string
        settings_text;  ///< all of them, those of the configuration too: with `picture` what `key` stands for
    JobStatus status = JobStatus::failed;
    std::string reason;  ///< why it is not done

    // Of the model; absent where there is none.
    std::optional<bool> valid;
    std::optional<double> min_singular;
    std::optional<int> zeros;
    std::optional<double> lowest_ratio,
        highest_ratio;                      ///< certificate's variance ratios over levels and planes
    std::optional<std::string> estimators;  ///< per level, finest first: "ls,ml"
    std::optional<int> fitted_levels;
    std::optional<std::uint64_t> parameters;

    // Of the texture, as it would be stored in the picture's type.
    std::optional<double> memd, memd_star;
    std::optional<double> variance_ratio;  ///< texture's variance / picture's, mean over planes
    std::optional<double> lag_covariance_error, spectral_covariance_error;
    std::optional<std::uint64_t> clamped_pixels;

    // Times and surroundings: no part of any comparison.
    double fit_seconds = 0.0;  ///< of the model, divided among its textures
    double synthesis_seconds = 0.0, memd_seconds = 0.0;
    std::string device;
};

/// What the picture itself says.
struct PictureFacts {
    std::string picture;
    double kappa = 0.0;  ///< κ(256)
    Size size;
    int planes = 0;
};

/// A texture in a file of its own.
struct KeptTexture {
    std::string picture, model, marginals, metric;
    std::string key;   ///< of the job
    std::string file;  ///< absolute path
};

/// Work on one picture.
struct WorkUnit {
    PictureSource source;
    std::vector<JobSettings> jobs;  ///< those of one fit follow each other
    bool keep = false;              ///< write the textures to files instead of measuring them
};

/// What a unit has brought so far.
struct WorkReport {
    std::optional<PictureFacts> facts;
    std::vector<JobResult> results;
    std::vector<KeptTexture> kept;
    std::string trouble;  ///< why a texture could not be kept
};

/// All jobs of a picture in the order of work: of one fit together, of larger orders before smaller ones,
/// since their lag covariances contain those of the smaller; rolls and BTF models last. The estimator is
/// `automatic` for models that have but one.
/// \throws InputError when a BTF model cannot be read, where they are asked for
[[nodiscard]] std::vector<JobSettings> job_settings(const ExperimentConfig& config);

/// Canonical JSON text of all that a texture and its measures depend on besides the picture.
[[nodiscard]] std::string settings_text(const ExperimentConfig& config, const JobSettings& settings);
[[nodiscard]] std::string job_key(const std::string& picture, const std::string& settings_text);

/// Expands the patterns, sorted by name within each entry, chooses directions, sorted view by view, and names
/// the contents. Pictures of BTFs are read for that, one by one, and thrown away.
/// \throws InputError when a pattern matches nothing, a file cannot be read, or two entries name the same
///     picture; when a set cannot be opened, or has not what is asked of it.
/// \param known  pictures of BTFs that need not be read; those that are become known
[[nodiscard]] std::vector<PictureSource> picture_sources(const ExperimentConfig& config, OpenSets& sets,
                                                         KnownPictures* known = nullptr);

/// Reads every picture whose shape is not known from before, and throws it away.
/// \param known  shape of a picture that was read before
/// \return the shape of each
/// \throws InputError naming the first picture, with its crop, that cannot be read or that the crop leaves,
///     and how many others there are
std::map<std::string, PictureShape> check_pictures(
    const std::vector<PictureSource>& sources,
    const std::function<std::optional<PictureShape>(const std::string& picture)>& known);

/// Whether what the configuration lists can be had of these pictures at all.
/// \param shapes  of the pictures
/// \throws InputError when a number of levels has no room in a picture, whatever order it goes with, or an
///     order, whatever number of levels, or a model, whatever both, for the planes that it has; when textures
///     are larger than any device could make them
void check_room(const ExperimentConfig& config, const std::vector<PictureSource>& sources,
                const std::map<std::string, PictureShape>& shapes);

/// "x,y,w,h", or nothing.
[[nodiscard]] std::string crop_text(const std::optional<Crop>& crop);
[[nodiscard]] std::string picture_identity(const std::string& content, const std::optional<Crop>& crop,
                                           double white);

}  // namespace btfield::detail
